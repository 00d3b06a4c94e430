// One island of a Problem, packed for the inner loops of the solver: local numbering, Jacobians
// without zero columns, block structure and factorization of M + J'GJ.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/contact/laws/cone_lanes.h"
#include "counterpoint/contact/linear/block_factorization.h"
#include "counterpoint/contact/linear/congruence.h"
#include "counterpoint/contact/linear/limbs.h"
#include "counterpoint/contact/linear/packed_jacobian.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

class IslandSystem {
 public:
  struct Constraint {
    Law law;                     ///< a copy, which the solver may soften
    double inverse_mass;         ///< estimate at the first row [1/kg]: J_0 inv(diag M) J_0'
    int row;                     ///< first row in the island
    int global_row;              ///< first row in the Problem
    int hessian;                 ///< start of its G among all G, row-major
    int first_place, end_place;  ///< destinations of its part of J'GJ: range in places_
  };

  /// Loads an island; blocks and constraints in increasing order. The problem must outlive its use
  /// here.
  void load(const Problem& problem, std::span<const int> blocks, std::span<const int> constraints,
            Factorization factorization);

  /// Must be called after changes to the laws of constraints().
  void laws_changed();

  int size() const { return size_; }
  int num_rows() const { return jacobian_.num_rows(); }
  /// Number of doubles of all G.
  int hessian_size() const { return hessian_size_; }
  const std::vector<Constraint>& constraints() const { return constraints_; }
  std::vector<Constraint>& constraints() { return constraints_; }
  const double* free_velocity() const { return free_velocity_.data(); }
  /// Contacts of three rows, processed four at a time.
  const FrictionLanes& lanes() const { return lanes_; }
  /// Indices of the constraints that are not in lanes().
  const std::vector<int>& single() const { return single_; }
  /// 1 / M_ii of each velocity.
  const double* inverse_diagonal() const { return inverse_diagonal_.data(); }
  /// Returns whether any law is `coulomb` now.
  bool unsymmetric() const;
  /// Returns whether all M_ii are positive.
  bool diagonal_positive() const { return diagonal_positive_; }

  /// Velocity block: its place in the island and in the Problem, M, and its groups.
  struct Block {
    int start;
    int size;
    int global_start;
    const double* mass;
    int first_group, num_groups;
  };
  const std::vector<Block>& blocks() const { return blocks_; }
  int block_of(int group) const { return group_blocks_[group]; }
  /// Parent of each velocity in its block, counted from the block's first velocity; -1 if none.
  const int* parents() const { return parents_.data(); }
  const PackedJacobian& jacobian() const { return jacobian_; }

  void gather(const double* global, double* local) const;
  void scatter(const double* local, double* global) const;

  /// Computes out = M x.
  void multiply_mass(const double* x, double* out) const;
  /// Computes out = J x.
  void multiply_jacobian(const double* x, double* out) const;
  /// Computes out = J x + b, in one fixed order of summation.
  void constraint_velocity(const double* x, double* out) const;
  /// Same for one constraint.
  void constraint_velocity(int constraint, const double* x, double* out) const;
  /// Adds J' f to out; returns the sum over constraints of |J_c' f_c|^2 in the norm of inv(diag M).
  double add_impulse(const double* f, double* out) const;
  /// Computes a bound on the round-off of y = J x + b, row by row.
  void velocity_roundoff(const double* x, double* out) const;
  /// Adds |J|' e to out, e >= 0 by rows.
  void add_absolute(const double* e, double* out) const;

  /// Factors M + J'GJ. False if it is not positive definite to working precision; with an
  /// `unsymmetric` G, if it is singular. LU pivots only where rounding would otherwise be amplified
  /// too much.
  bool factor(const double* hessian, bool unsymmetric);
  /// Solves x = inv(M + J'GJ) x.
  void solve(double* x) const { factorization_.solve(x); }

 private:
  /// Nonzero part of M and its destination.
  struct MassPart {
    DenseBlock mass;
    BlockFactorization::Block place;
    bool diagonal;
  };
  void load_blocks(const Problem& problem, std::span<const int> blocks);
  void load_constraints(const Problem& problem, std::span<const int> constraints);
  void pack_side(const Problem& problem, int constraint, int side);
  void find_groups(bool dense);
  void estimate_inverse_masses();
  void analyze();
  void place();
  void place_mass();
  void place_constraints();
  void assemble_mass();
  void assemble(const double* hessian, bool unsymmetric);

  int size_ = 0, hessian_size_ = 0;
  bool diagonal_positive_ = true, dense_ = false;
  bool placed_ = false;      ///< mass_parts_ and places_ are those of this island
  bool mass_ready_ = false;  ///< the factorization has M as its common part
  std::vector<Block> blocks_;
  std::vector<Constraint> constraints_;
  std::vector<int> local_block_;  ///< local index of each block of the Problem
  FrictionLanes lanes_;
  std::vector<int> single_;
  PackedJacobian jacobian_;
  std::vector<double> free_velocity_, inverse_diagonal_, bias_;
  // Groups are the blocks of the factorization: limbs of trees or, if dense, whole velocity blocks.
  Limbs limbs_;
  std::vector<PackedJacobian::Group> groups_;
  std::vector<int> group_sizes_, group_blocks_, parents_;
  std::vector<std::pair<int, int>> mass_couples_;
  std::vector<MassPart> mass_parts_;
  std::vector<CongruencePlace> places_;
  std::vector<double> scratch_;
  BlockFactorization factorization_;
};

}  // namespace counterpoint::contact
