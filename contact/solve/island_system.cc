#include "counterpoint/contact/solve/island_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/linear/dense_kernels.h"

namespace counterpoint::contact {
namespace {

// Largest growth of LU without pivoting that is accepted: Newton's direction then has about ten
// correct digits.
constexpr double kMostGrowth = 1e5;

}  // namespace

void IslandSystem::load(const Problem& problem, std::span<const int> blocks,
                        std::span<const int> constraints, Factorization factorization) {
  load_blocks(problem, blocks);
  find_groups(factorization == Factorization::kDense);
  load_constraints(problem, constraints);
  estimate_inverse_masses();
  laws_changed();
  analyze();
}

void IslandSystem::laws_changed() {
  lanes_.clear();
  lanes_.reserve(constraints_.size());
  bias_.clear();
  single_.clear();
  single_.reserve(constraints_.size());
  for (size_t i = 0; i < constraints_.size(); ++i) {
    const Constraint& c = constraints_[i];
    bias_.insert(bias_.end(), c.law.bias.begin(), c.law.bias.begin() + c.law.rows);
    const int index = static_cast<int>(i);
    if (!lanes_.add(c.law, c.inverse_mass, c.row, c.hessian)) single_.push_back(index);
  }
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

void IslandSystem::find_groups(bool dense) {
  dense_ = dense;
  groups_.clear();
  group_sizes_.clear();
  group_blocks_.clear();
  parents_.clear();
  mass_couples_.clear();
  for (Block& b : blocks_) {
    b.first_group = static_cast<int>(groups_.size());
    int velocity = b.start;
    if (dense) {
      if (b.size > 0) groups_.push_back({b.start, b.size});
      for (int i = 0; i < b.size; ++i) parents_.push_back(i - 1);
    } else {
      limbs_.find(b.mass, b.size);
      for (const int size : limbs_.sizes()) {
        groups_.push_back({velocity, size});
        velocity += size;
      }
      for (const auto& [i, j] : limbs_.couples())
        mass_couples_.emplace_back(b.first_group + i, b.first_group + j);
      parents_.insert(parents_.end(), limbs_.parents().begin(), limbs_.parents().end());
    }
    b.num_groups = static_cast<int>(groups_.size()) - b.first_group;
    group_blocks_.resize(groups_.size(), static_cast<int>(&b - blocks_.data()));
  }
  for (const auto& group : groups_) group_sizes_.push_back(group.size);
}

// A constraint between a block and itself has the sum of both Jacobians.
void IslandSystem::pack_side(const Problem& problem, int constraint, int side) {
  const int block = problem.block(constraint, side);
  const bool same = problem.block(constraint, 0) == problem.block(constraint, 1);
  if (block < 0 || (side == 1 && same)) return;
  const Block& b = blocks_[local_block_[block]];
  if (b.size == 0) return;
  jacobian_.add_side(problem.jacobian(constraint, side).data(),
                     same ? problem.jacobian(constraint, 1 - side).data() : nullptr, b.size,
                     groups_.data() + b.first_group, b.num_groups, b.first_group);
}

void IslandSystem::load_constraints(const Problem& problem, std::span<const int> constraints) {
  constraints_.clear();
  jacobian_.clear();
  hessian_size_ = 0;
  for (const int i : constraints) {
    Constraint& c = constraints_.emplace_back();
    c.law = problem.law(i);
    c.law.coulomb = c.law.coulomb && c.law.type == LawType::kFrictionCone;
    c.row = jacobian_.num_rows();
    c.global_row = problem.first_row(i);
    c.hessian = hessian_size_;
    hessian_size_ += c.law.rows * c.law.rows;
    jacobian_.begin_constraint(c.law.rows);
    for (const int side : {0, 1}) pack_side(problem, i, side);
    jacobian_.end_constraint();
  }
}

// Finds the pattern of M + J'GJ by groups and its elimination order.
void IslandSystem::analyze() {
  factorization_.begin_structure(group_sizes_);
  const int num_groups = static_cast<int>(groups_.size());
  if (dense_) {
    for (int g = 1; g < num_groups; ++g) {
      for (int h = 0; h < g; ++h) factorization_.add_coupling(g, h);
    }
  } else {
    for (const auto& [g, h] : mass_couples_) factorization_.add_coupling(g, h);
    for (const auto& c : jacobian_.constraints()) {
      for (int s = c.first_strip; s < c.end_strip; ++s) {
        for (int t = c.first_strip; t < s; ++t)
          factorization_.add_coupling(jacobian_.strips()[s].group, jacobian_.strips()[t].group);
      }
    }
  }
  factorization_.end_structure();
  placed_ = false;
  // Reserves memory for place(), so that it does not allocate in the middle of a run.
  size_t places = 0, scratch = 0;
  for (const auto& c : jacobian_.constraints()) {
    const size_t strips = c.end_strip - c.first_strip;
    places += strips * (strips + 1) / 2;
    scratch = std::max(scratch, 2 * static_cast<size_t>(c.rows) * c.leading);
  }
  places_.reserve(places);
  mass_parts_.reserve(groups_.size() + mass_couples_.size());
  scratch_.resize(std::max(scratch, scratch_.size()));
}

// Finds the destinations of the parts of M and J'GJ: once per island, and only if a step factors.
void IslandSystem::place() {
  if (placed_) return;
  placed_ = true;
  place_mass();
  place_constraints();
}

void IslandSystem::place_mass() {
  mass_parts_.clear();
  mass_ready_ = false;
  auto couple = mass_couples_.begin();
  for (const Block& b : blocks_) {
    const auto add = [&](int row_group, int column_group) {
      if (!factorization_.is_lower(row_group, column_group)) std::swap(row_group, column_group);
      const auto& row = groups_[row_group];
      const auto& column = groups_[column_group];
      const double* values = b.mass + static_cast<ptrdiff_t>(column.velocity - b.start) * b.size +
                             (row.velocity - b.start);
      mass_parts_.push_back({{values, b.size, row.size, column.size},
                             factorization_.block(row_group, column_group),
                             row_group == column_group});
    };
    const int end = b.first_group + b.num_groups;
    for (int g = b.first_group; g < end; ++g) add(g, g);
    for (; couple != mass_couples_.end() && couple->first < end; ++couple)
      add(couple->first, couple->second);
  }
}

void IslandSystem::place_constraints() {
  places_.clear();
  for (size_t i = 0; i < constraints_.size(); ++i) {
    const PackedJacobian::Constraint& c = jacobian_.constraints()[i];
    if (i > 0 && jacobian_.touch_the_same(jacobian_.constraints()[i - 1], c)) {
      constraints_[i].first_place = constraints_[i - 1].first_place;
      constraints_[i].end_place = constraints_[i - 1].end_place;
      continue;
    }
    constraints_[i].first_place = static_cast<int>(places_.size());
    int column_s = 0;
    for (int s = c.first_strip; s < c.end_strip; ++s) {
      const auto& strip_s = jacobian_.strips()[s];
      int column_t = 0;
      for (int t = c.first_strip; t <= s; ++t) {
        const auto& strip_t = jacobian_.strips()[t];
        const bool lower = factorization_.is_lower(strip_s.group, strip_t.group);
        const auto& row = lower ? strip_s : strip_t;
        const auto& column = lower ? strip_t : strip_s;
        const auto block = factorization_.block(row.group, column.group);
        const ptrdiff_t row_offset = row.velocity - groups_[row.group].velocity;
        const ptrdiff_t column_offset = column.velocity - groups_[column.group].velocity;
        places_.push_back({block.offset + row_offset + column_offset * block.leading, block.leading,
                           lower ? column_s : column_t, row.size, lower ? column_t : column_s,
                           column.size, s == t});
        column_t += strip_t.size;
      }
      column_s += strip_s.size;
    }
    constraints_[i].end_place = static_cast<int>(places_.size());
  }
}

bool IslandSystem::unsymmetric() const {
  return !lanes_.coulomb().empty() || std::any_of(single_.begin(), single_.end(), [this](int i) {
    return constraints_[i].law.coulomb;
  });
}

void IslandSystem::estimate_inverse_masses() {
  double largest = 0.0;
  for (size_t i = 0; i < constraints_.size(); ++i) {
    Constraint& c = constraints_[i];
    c.inverse_mass =
        jacobian_.first_row_square(jacobian_.constraints()[i], inverse_diagonal_.data());
    largest = std::max(largest, c.inverse_mass);
  }
  // Along a normal in which nothing can move the inverse mass would be round-off; those of the
  // heaviest of masses 1 : 1e8 stay as they are.
  const double least = std::pow(std::numeric_limits<double>::epsilon(), 2.0 / 3.0) * largest;
  for (Constraint& c : constraints_) c.inverse_mass = std::max(c.inverse_mass, least);
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
  jacobian_.multiply(x, out);
}

void IslandSystem::constraint_velocity(const double* x, double* out) const {
  multiply_jacobian(x, out);
  for (size_t i = 0; i < bias_.size(); ++i) out[i] += bias_[i];
}

void IslandSystem::constraint_velocity(int constraint, const double* x, double* out) const {
  const PackedJacobian::Constraint& c = jacobian_.constraints()[constraint];
  jacobian_.multiply(c, x, out);
  for (int r = 0; r < c.rows; ++r) out[r] += bias_[c.row + r];
}

double IslandSystem::add_impulse(const double* f, double* out) const {
  return jacobian_.add_transposed(f, inverse_diagonal_.data(), out);
}

void IslandSystem::velocity_roundoff(const double* x, double* out) const {
  for (size_t i = 0; i < bias_.size(); ++i) out[i] = std::abs(bias_[i]);
  jacobian_.add_absolute(x, out);
  for (int i = 0; i < num_rows(); ++i) out[i] *= std::numeric_limits<double>::epsilon();
}

void IslandSystem::add_absolute(const double* e, double* out) const {
  jacobian_.add_absolute_transposed(e, out);
}

// Assembles M, once per island.
void IslandSystem::assemble_mass() {
  factorization_.set_zero(false);
  double* lower = factorization_.lower({0, 0});
  for (const MassPart& part : mass_parts_)
    copy_block(part.mass, lower + part.place.offset, part.place.leading);
  factorization_.keep_common();
  mass_ready_ = true;
}

// Assembles M + J'GJ, both triangles if G is unsymmetric.
void IslandSystem::assemble(const double* hessian, bool unsymmetric) {
  if (!mass_ready_) assemble_mass();
  factorization_.set_common(unsymmetric);
  double* lower = factorization_.lower({0, 0});
  double* upper = unsymmetric ? factorization_.upper({0, 0}) : nullptr;
  for (size_t i = 0; i < constraints_.size(); ++i) {
    const Constraint& c = constraints_[i];
    const PackedJacobian::Constraint& packed = jacobian_.constraints()[i];
    const double* g = hessian + c.hessian;
    // Open contacts far away have G = 0.
    if (std::all_of(g, g + packed.rows * packed.rows, [](double x) { return x == 0.0; })) continue;
    add_congruence(packed.rows, packed.leading, jacobian_.by_row(packed), g,
                   std::span(places_).subspan(c.first_place, c.end_place - c.first_place),
                   scratch_.data(), lower, upper);
  }
  if (!unsymmetric) return;
  for (const MassPart& part : mass_parts_) {
    if (!part.diagonal) continue;
    transpose_diagonal(lower + part.place.offset, upper + part.place.offset, part.mass.cols,
                       part.place.leading);
  }
}

bool IslandSystem::factor(const double* hessian, bool unsymmetric) {
  place();
  assemble(hessian, unsymmetric);
  if (!unsymmetric) return factorization_.factor_cholesky();
  const bool factored = factorization_.factor_lu();
  if ((factored && factorization_.growth() <= kMostGrowth) || !factorization_.can_pivot())
    return factored;
  assemble(hessian, unsymmetric);
  return factorization_.factor_pivoted();
}

}  // namespace counterpoint::contact
