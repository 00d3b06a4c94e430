#include "counterpoint/contact/island_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/dense_kernels.h"
#include "counterpoint/contact/row_count.h"

namespace counterpoint::contact {
namespace {

// Islands up to this size, or touching every block from every other, are factored densely.
constexpr int kDenseSize = 12;
// A normal along which nothing can move has an inverse mass of round-off: not less than this share
// of the island's largest is taken for it.
constexpr double kLeastInverseMass = 1e-9;

}  // namespace

void IslandSystem::load(const Problem& problem, std::span<const int> blocks,
                        std::span<const int> constraints, Factorization factorization) {
  load_blocks(problem, blocks);
  load_constraints(problem, constraints);
  estimate_inverse_masses();
  analyze(factorization);
}

void IslandSystem::load_blocks(const Problem& problem, std::span<const int> blocks) {
  blocks_.clear();
  local_block_.resize(problem.num_blocks());
  size_ = 0;
  for (const int b : blocks) {
    local_block_[b] = static_cast<int>(blocks_.size());
    const int n = problem.block_size(b);
    blocks_.push_back({size_, n, problem.block_start(b), problem.mass(b).data(), 0, 0});
    size_ += n;
  }
  free_velocity_.resize(size_);
  inverse_diagonal_.resize(size_);
  gather(problem.free_velocity().data(), free_velocity_.data());
  diagonal_positive_ = true;
  for (const Block& b : blocks_) {
    for (int i = 0; i < b.size; ++i) {
      const double diagonal = b.mass[i * b.size + i];
      diagonal_positive_ = diagonal_positive_ && diagonal > 0.0;
      inverse_diagonal_[b.start + i] = 1.0 / diagonal;
    }
  }
}

// Appends the columns of one side that are not zero. A constraint between a block and itself has
// the sum of both Jacobians.
void IslandSystem::pack_side(const Problem& problem, int constraint, int side, int start) {
  const ConstMatrixMap jacobian = problem.jacobian(constraint, side);
  const bool both = problem.block(constraint, 0) == problem.block(constraint, 1);
  const ConstMatrixMap other = problem.jacobian(constraint, both ? 1 - side : side);
  const int rows = static_cast<int>(jacobian.rows());
  for (int j = 0; j < jacobian.cols(); ++j) {
    double column[kMaxRows];
    bool zero = true;
    for (int r = 0; r < rows; ++r) {
      column[r] = both ? jacobian(r, j) + other(r, j) : jacobian(r, j);
      zero = zero && column[r] == 0.0;
    }
    if (zero) continue;
    columns_.push_back(start + j);
    jacobian_.insert(jacobian_.end(), column, column + rows);
  }
}

void IslandSystem::load_constraints(const Problem& problem, std::span<const int> constraints) {
  constraints_.clear();
  columns_.clear();
  jacobian_.clear();
  row_jacobian_.clear();
  num_rows_ = hessian_size_ = 0;
  for (const int i : constraints) {
    Constraint c{};
    c.law = problem.law(i);
    c.law.coulomb = c.law.coulomb && c.law.type == LawType::kFrictionCone;
    c.row = num_rows_;
    c.global_row = problem.first_row(i);
    c.column = static_cast<int>(columns_.size());
    c.jacobian = static_cast<int>(jacobian_.size());
    c.hessian = hessian_size_;
    c.group[1] = -1;
    for (int side = 0; side < 2; ++side) {
      const int block = problem.block(i, side);
      if (block < 0 || (side == 1 && block == problem.block(i, 0))) continue;
      c.group[side] = local_block_[block];
      pack_side(problem, i, side, blocks_[local_block_[block]].start);
      if (side == 0) c.split = static_cast<int>(columns_.size()) - c.column;
    }
    c.num_columns = static_cast<int>(columns_.size()) - c.column;
    row_jacobian_.resize(jacobian_.size());
    for (int k = 0; k < c.num_columns; ++k) {
      for (int r = 0; r < c.law.rows; ++r)
        row_jacobian_[c.jacobian + r * c.num_columns + k] =
            jacobian_[c.jacobian + k * c.law.rows + r];
    }
    num_rows_ += c.law.rows;
    hessian_size_ += c.law.rows * c.law.rows;
    constraints_.push_back(c);
  }
}

void IslandSystem::analyze(Factorization factorization) {
  dense_ = factorization == Factorization::kDense || blocks_.size() == 1 ||
           (factorization == Factorization::kAutomatic && size_ <= kDenseSize);
  group_sizes_.clear();
  if (dense_) group_sizes_.push_back(size_);
  for (size_t i = 0; i < blocks_.size(); ++i) {
    blocks_[i].group = dense_ ? 0 : static_cast<int>(i);
    blocks_[i].offset = dense_ ? blocks_[i].start : 0;
    if (!dense_) group_sizes_.push_back(blocks_[i].size);
  }
  factorization_.begin_structure(group_sizes_);
  places_.resize(columns_.size());
  for (Constraint& c : constraints_) {
    for (int side = 0; side < 2; ++side) {
      if (c.group[side] < 0) continue;
      const Block& b = blocks_[c.group[side]];
      const int first = side == 0 ? 0 : c.split;
      const int last = side == 0 ? c.split : c.num_columns;
      for (int j = first; j < last; ++j) {
        places_[c.column + j] = columns_[c.column + j] - b.start + b.offset;
      }
      c.group[side] = b.group;
    }
    if (c.group[1] == c.group[0]) {
      c.group[1] = -1;  // one factorization block: both sides are one range of columns
      c.split = c.num_columns;
    }
    if (c.group[1] >= 0) factorization_.add_coupling(c.group[0], c.group[1]);
  }
  factorization_.end_structure();
  for (Constraint& c : constraints_) {
    c.target[0] = factorization_.block(c.group[0], c.group[0]);
    if (c.group[1] < 0) continue;
    c.target[1] = factorization_.block(c.group[1], c.group[1]);
    c.swapped = !factorization_.is_lower(c.group[0], c.group[1]);
    c.target[2] = c.swapped ? factorization_.block(c.group[1], c.group[0])
                            : factorization_.block(c.group[0], c.group[1]);
  }
}

bool IslandSystem::unsymmetric() const {
  return std::any_of(constraints_.begin(), constraints_.end(),
                     [](const Constraint& c) { return c.law.coulomb; });
}

void IslandSystem::estimate_inverse_masses() {
  double largest = 0.0;
  for (Constraint& c : constraints_) {
    c.inverse_mass = 0.0;
    for (int k = 0; k < c.num_columns; ++k) {
      const double j = jacobian_[c.jacobian + k * c.law.rows];
      c.inverse_mass += j * j * inverse_diagonal_[columns_[c.column + k]];
    }
    largest = std::max(largest, c.inverse_mass);
  }
  for (Constraint& c : constraints_) {
    c.inverse_mass = std::max(c.inverse_mass, kLeastInverseMass * largest);
  }
}

void IslandSystem::gather(const double* global, double* local) const {
  for (const Block& b : blocks_) {
    std::copy(global + b.global_start, global + b.global_start + b.size, local + b.start);
  }
}

void IslandSystem::scatter(const double* local, double* global) const {
  for (const Block& b : blocks_) {
    std::copy(local + b.start, local + b.start + b.size, global + b.global_start);
  }
}

void IslandSystem::multiply_mass(const double* x, double* out) const {
  for (const Block& b : blocks_) {
    multiply_symmetric(b.mass, b.size, x + b.start, out + b.start);
  }
}

void IslandSystem::multiply_jacobian(const double* x, double* out) const {
  for (const Constraint& c : constraints_) {
    with_rows(c.law.rows, [&]<int N>(RowCount<N>) {
      double y[N] = {};
      const double* j = jacobian_.data() + c.jacobian;
      const int* column = columns_.data() + c.column;
      for (int k = 0; k < c.num_columns; ++k, j += N) {
        const double value = x[column[k]];
        for (int r = 0; r < N; ++r) y[r] += j[r] * value;
      }
      std::copy(y, y + N, out + c.row);
    });
  }
}

void IslandSystem::constraint_velocity(const double* x, double* out) const {
  multiply_jacobian(x, out);
  for (const Constraint& c : constraints_) {
    for (int r = 0; r < c.law.rows; ++r) out[c.row + r] += c.law.bias[r];
  }
}

double IslandSystem::add_impulse(const double* f, double* out) const {
  double square = 0.0;
  for (const Constraint& c : constraints_) {
    with_rows(c.law.rows, [&]<int N>(RowCount<N>) {
      double own[N];
      std::copy(f + c.row, f + c.row + N, own);
      const double* j = jacobian_.data() + c.jacobian;
      for (int k = 0; k < c.num_columns; ++k, j += N) {
        double sum = 0.0;
        for (int r = 0; r < N; ++r) sum += j[r] * own[r];
        const int column = columns_[c.column + k];
        out[column] += sum;
        square += sum * sum * inverse_diagonal_[column];
      }
    });
  }
  return square;
}

void IslandSystem::velocity_roundoff(const double* x, double* out) const {
  for (const Constraint& c : constraints_) {
    const int rows = c.law.rows;
    double y[kMaxRows];
    for (int r = 0; r < rows; ++r) y[r] = std::abs(c.law.bias[r]);
    const double* j = jacobian_.data() + c.jacobian;
    for (int k = 0; k < c.num_columns; ++k, j += rows) {
      const double value = std::abs(x[columns_[c.column + k]]);
      for (int r = 0; r < rows; ++r) y[r] += std::abs(j[r]) * value;
    }
    for (int r = 0; r < rows; ++r) {
      out[c.row + r] = std::numeric_limits<double>::epsilon() * y[r];
    }
  }
}

void IslandSystem::add_absolute(const double* e, double* out) const {
  for (const Constraint& c : constraints_) {
    const int rows = c.law.rows;
    const double* j = jacobian_.data() + c.jacobian;
    for (int k = 0; k < c.num_columns; ++k, j += rows) {
      for (int r = 0; r < rows; ++r) out[columns_[c.column + k]] += std::abs(j[r]) * e[c.row + r];
    }
  }
}

void IslandSystem::add_mass() {
  for (const Block& b : blocks_) {
    const BlockFactorization::Block place = factorization_.block(b.group, b.group);
    double* target = factorization_.lower(place) + b.offset;
    for (int j = 0; j < b.size; ++j) {
      const double* row = b.mass + static_cast<ptrdiff_t>(j) * b.size;
      std::copy(row, row + b.size, target + static_cast<ptrdiff_t>(b.offset + j) * place.leading);
    }
  }
}

// J'GJ into the lower blocks, with an unsymmetric G into whole diagonal blocks and the upper one
// too.
void IslandSystem::add_hessian(const Constraint& c, const double* g, bool unsymmetric) {
  const int rows = c.law.rows;
  const double* j = row_jacobian_.data() + c.jacobian;
  const int* places = places_.data() + c.column;
  Columns a{j, c.num_columns, places, c.split};
  Columns b{j + c.split, c.num_columns, places + c.split, c.num_columns - c.split};
  const auto add = [&](double* block, int target, const Columns& left, const Columns& right,
                       const double* G, bool half) {
    add_congruence(rows, left, right, G, block, c.target[target].leading, half);
  };
  add(factorization_.lower(c.target[0]), 0, a, a, g, !unsymmetric);
  if (c.group[1] < 0) return;
  add(factorization_.lower(c.target[1]), 1, b, b, g, !unsymmetric);
  if (c.swapped) std::swap(a, b);
  add(factorization_.lower(c.target[2]), 2, a, b, g, false);
  if (!unsymmetric) return;
  double transpose[kMaxRows * kMaxRows];
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < rows; ++k) transpose[i * rows + k] = g[k * rows + i];
  }
  add(factorization_.upper(c.target[2]), 2, a, b, transpose, false);
}

bool IslandSystem::factor(const double* hessian, bool unsymmetric) {
  factorization_.set_zero(unsymmetric);
  add_mass();
  for (const Constraint& c : constraints_) {
    add_hessian(c, hessian + c.hessian, unsymmetric);
  }
  return unsymmetric ? factorization_.factor_lu() : factorization_.factor_cholesky();
}

}  // namespace counterpoint::contact
