#include "counterpoint/contact/problem.h"

#include <algorithm>
#include <cstddef>

#include "counterpoint/contact/lanes/vector_lanes.h"

namespace counterpoint::contact {
namespace {

// Returns whether all numbers are finite: x - x is zero for finite x, else NaN.
COUNTERPOINT_WIDE bool all_finite(const double* x, std::ptrdiff_t count) {
  Four sums[2] = {};
  std::ptrdiff_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (int j = 0; j < 2; ++j) {
      Four value;
      load(x + i + 4 * j, value);
      sums[j] += value - value;
    }
  }
  const Four four = sums[0] + sums[1];
  double sum = (four[0] + four[1]) + (four[2] + four[3]);
  for (; i < count; ++i) sum += x[i] - x[i];
  return sum == 0.0;
}
bool all_finite(const std::vector<double>& x) {
  return all_finite(x.data(), static_cast<std::ptrdiff_t>(x.size()));
}

}  // namespace

bool Problem::is_finite() const {
  return all_finite(mass_data_) && all_finite(free_velocity_) && all_finite(jacobian_data_) &&
         std::all_of(constraints_.begin(), constraints_.end(),
                     [](const Constraint& c) { return contact::is_finite(c.law); });
}

void Problem::clear() {
  block_start_.assign(1, 0);
  mass_start_.clear();
  mass_data_.clear();
  free_velocity_.clear();
  jacobian_data_.clear();
  constraints_.clear();
  num_rows_ = 0;
}

int Problem::add_block(int size) {
  mass_start_.push_back(static_cast<int>(mass_data_.size()));
  mass_data_.resize(mass_data_.size() + static_cast<size_t>(size) * size, 0.0);
  block_start_.push_back(block_start_.back() + size);
  free_velocity_.resize(block_start_.back(), 0.0);
  return num_blocks() - 1;
}

int Problem::add_constraint(const Law& law, int block_a, int block_b) {
  Constraint& c = constraints_.emplace_back();
  c.law = law;
  c.first_row = num_rows_;
  c.block = {block_a, block_b};
  for (int side = 0; side < 2; ++side) {
    c.jacobian_start[side] = static_cast<int>(jacobian_data_.size());
    const int block = c.block[side];
    if (block < 0) continue;
    jacobian_data_.resize(jacobian_data_.size() + static_cast<size_t>(law.rows) * block_size(block),
                          0.0);
  }
  num_rows_ += law.rows;
  return num_constraints() - 1;
}

MatrixMap Problem::mass(int block) {
  const int n = block_size(block);
  return {mass_data_.data() + mass_start_[block], n, n};
}
ConstMatrixMap Problem::mass(int block) const {
  const int n = block_size(block);
  return {mass_data_.data() + mass_start_[block], n, n};
}
VectorMap Problem::free_velocity() { return {free_velocity_.data(), num_velocities()}; }
ConstVectorMap Problem::free_velocity() const { return {free_velocity_.data(), num_velocities()}; }

MatrixMap Problem::jacobian(int constraint, int side) {
  const Constraint& c = constraints_[constraint];
  return {jacobian_data_.data() + c.jacobian_start[side], c.law.rows, block_size(c.block[side])};
}
ConstMatrixMap Problem::jacobian(int constraint, int side) const {
  const Constraint& c = constraints_[constraint];
  return {jacobian_data_.data() + c.jacobian_start[side], c.law.rows, block_size(c.block[side])};
}

}  // namespace counterpoint::contact
