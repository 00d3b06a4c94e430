#include "counterpoint/contact/solve/responses.h"

#include <algorithm>
#include <cstddef>

#include "counterpoint/contact/lanes/wide.h"
#include "counterpoint/contact/linear/row_count.h"
#include "counterpoint/contact/linear/tree_factor.h"

namespace counterpoint::contact {
namespace {

template <int N>
COUNTERPOINT_INTO_EACH void add_rows(const double* values, int size, const double* f,
                                     double* __restrict w) {
  for (int v = 0; v < size; ++v) {
    double sum = values[v] * f[0];
    COUNTERPOINT_UNROLL
    for (int r = 1; r < N; ++r) sum += values[r * size + v] * f[r];
    w[v] += sum;
  }
}

COUNTERPOINT_WIDE void add_response(int rows, const double* values, int size, const double* f,
                                    double* w) {
  with_rows(
      rows, [&]<int N>(RowCount<N>)
                __attribute__((always_inline)) { add_rows<N>(values, size, f, w); });
}

// Rows solved at a time.
constexpr int kLanes = 4;

}  // namespace

void Responses::reserve(const IslandSystem& system) {
  size_t factors = 0, largest = 0;
  for (const auto& b : system.blocks()) {
    factors += static_cast<size_t>(b.size) * b.size;
    largest = std::max(largest, static_cast<size_t>(b.size));
  }
  const size_t constraints = system.constraints().size();
  first_factor_.reserve(system.blocks().size());
  known_.reserve(constraints);
  parts_.reserve(2 * constraints);
  factors_.reserve(factors);
  values_.reserve(system.num_rows() * (2 * largest + kMaxRows));
  scratch_.reserve(std::max<size_t>(kLanes * largest, system.size()));
}

bool Responses::begin(const IslandSystem& system) {
  system_ = &system;
  first_factor_.clear();
  factors_.clear();
  parts_.clear();
  values_.clear();
  known_.assign(system.constraints().size(), {});
  for (const auto& b : system.blocks()) {
    const size_t first = factors_.size(), count = static_cast<size_t>(b.size) * b.size;
    first_factor_.push_back(static_cast<int>(first));
    factors_.insert(factors_.end(), b.mass, b.mass + count);
    if (!factor_tree(system.parents() + b.start, b.size, factors_.data() + first)) return false;
  }
  return true;
}

void Responses::velocity(const double* f, double* w) {
  const size_t n = system_->size();
  scratch_.assign(n, 0.0);
  system_->add_impulse(f, scratch_.data());
  for (size_t b = 0; b < first_factor_.size(); ++b) {
    const auto& block = system_->blocks()[b];
    solve_tree(system_->parents() + block.start, block.size, factors_.data() + first_factor_[b],
               scratch_.data() + block.start);
  }
  for (size_t i = 0; i < n; ++i) w[i] = system_->free_velocity()[i] + scratch_[i];
}

// Finds the response to a constraint. Strips of the same block are adjacent.
void Responses::find(int constraint) {
  const auto& jacobian = system_->jacobian();
  const auto& c = jacobian.constraints()[constraint];
  Known& known = known_[constraint];
  known.first_part = static_cast<int>(parts_.size());
  known.own = static_cast<int>(values_.size());
  values_.resize(values_.size() + static_cast<size_t>(c.rows) * c.rows, 0.0);
  const auto block = [&](int s) { return system_->block_of(jacobian.strips()[s].group); };
  int column = 0;
  for (int s = c.first_strip; s < c.end_strip;) {
    int end = s + 1;
    while (end < c.end_strip && block(end) == block(s)) ++end;
    column = find_part(constraint, s, end, column);
    s = end;
  }
  known.num_parts = static_cast<int>(parts_.size()) - known.first_part;
}

// Finds the response of the velocity block of the strips first ... end - 1, which start at `column`
// of J, and adds its share of J_c inv(M) J_c'. Returns the column after the last.
int Responses::find_part(int constraint, int first, int end, int column) {
  const auto& jacobian = system_->jacobian();
  const auto& c = jacobian.constraints()[constraint];
  const int b = system_->block_of(jacobian.strips()[first].group);
  const auto& block = system_->blocks()[b];
  const int first_value = static_cast<int>(values_.size()), n = block.size;
  values_.resize(values_.size() + static_cast<size_t>(c.rows) * n);
  // Calls visit(velocity in the block, column of J).
  const auto for_columns = [&](auto visit) {
    int at = column;
    for (int s = first; s < end; ++s) {
      const auto& strip = jacobian.strips()[s];
      for (int k = 0; k < strip.size; ++k, ++at) visit(strip.velocity - block.start + k, at);
    }
    return at;
  };
  const auto entry = [&](int row, int at) { return jacobian.by_row(c)[row * c.leading + at]; };
  double* values = values_.data() + first_value;
  for (int first_row = 0; first_row < c.rows; first_row += kLanes) {
    const int rows = std::min(c.rows - first_row, kLanes);
    scratch_.assign(static_cast<size_t>(kLanes) * n, 0.0);
    for_columns([&](int v, int at) {
      for (int r = 0; r < rows; ++r) scratch_[kLanes * v + r] = entry(first_row + r, at);
    });
    solve_tree_four(system_->parents() + block.start, n, factors_.data() + first_factor_[b],
                    scratch_.data());
    for (int r = 0; r < rows; ++r)
      for (int v = 0; v < n; ++v) values[(first_row + r) * n + v] = scratch_[kLanes * v + r];
  }
  double* own = values_.data() + known_[constraint].own;
  parts_.push_back({block.start, n, first_value});
  return for_columns([&](int v, int at) {
    for (int r = 0; r < c.rows; ++r)
      for (int q = 0; q < c.rows; ++q) own[r * c.rows + q] += entry(r, at) * values[q * n + v];
  });
}

const double* Responses::own(int constraint) {
  if (!knows(constraint)) find(constraint);
  return values_.data() + known_[constraint].own;
}

void Responses::add(int constraint, const double* f, double* w) {
  if (!knows(constraint)) find(constraint);
  const Known& known = known_[constraint];
  const int rows = system_->jacobian().constraints()[constraint].rows;
  for (int i = known.first_part; i < known.first_part + known.num_parts; ++i) {
    const Part& part = parts_[i];
    add_response(rows, values_.data() + part.first_value, part.size, f, w + part.velocity);
  }
}

}  // namespace counterpoint::contact
