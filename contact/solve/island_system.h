// One island of a Problem, packed for the inner loops of the solver: local numbering, Jacobians
// without their zero columns, the block structure of M + J'GJ and its factorization.
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
    Law law;              ///< its own copy: the solver may change its smoothing on the way
    double inverse_mass;  ///< [1/kg] felt by the first row, an estimate: J_0 inv(diag M) J_0'
    int row;              ///< first local row
    int global_row;       ///< first row in the Problem
    int hessian;          ///< start of its G among all G, row-major
    int first_place, end_place;  ///< where its part of J'GJ goes: in places_
  };

  /// Blocks and constraints in increasing order. The problem must outlive its use here.
  void load(const Problem& problem, std::span<const int> blocks, std::span<const int> constraints,
            Factorization factorization);

  /// To be called when the laws of constraints() have been changed.
  void laws_changed();

  int size() const { return size_; }
  int num_rows() const { return jacobian_.num_rows(); }
  /// Doubles needed for all G.
  int hessian_size() const { return hessian_size_; }
  const std::vector<Constraint>& constraints() const { return constraints_; }
  std::vector<Constraint>& constraints() { return constraints_; }
  const double* free_velocity() const { return free_velocity_.data(); }
  /// Contacts of three rows, four by four.
  const FrictionLanes& lanes() const { return lanes_; }
  /// The constraints not in lanes().
  const std::vector<int>& single() const { return single_; }
  /// 1 / M_ii.
  const double* inverse_diagonal() const { return inverse_diagonal_.data(); }
  /// Some law is `coulomb` now.
  bool unsymmetric() const;
  /// All M_ii are positive.
  bool diagonal_positive() const { return diagonal_positive_; }

  /// A velocity block: its place here and in the Problem, M, and its groups.
  struct Block {
    int start;
    int size;
    int global_start;
    const double* mass;
    int first_group, num_groups;
  };
  const std::vector<Block>& blocks() const { return blocks_; }
  int block_of(int group) const { return group_blocks_[group]; }
  /// The velocity of its block next to each on its way to the root, counted from the block's first;
  /// -1: none.
  const int* parents() const { return parents_.data(); }
  const PackedJacobian& jacobian() const { return jacobian_; }

  void gather(const double* global, double* local) const;
  void scatter(const double* local, double* global) const;

  /// out = M x.
  void multiply_mass(const double* x, double* out) const;
  /// out = J x.
  void multiply_jacobian(const double* x, double* out) const;
  /// out = J x + b, in one fixed order of summation.
  void constraint_velocity(const double* x, double* out) const;
  /// The same of one constraint.
  void constraint_velocity(int constraint, const double* x, double* out) const;
  /// out += J' f; returns the sum over constraints of |J_c' f_c|^2 in the norm of inv(diag M).
  double add_impulse(const double* f, double* out) const;
  /// A bound on the round-off of y = J x + b, row by row.
  void velocity_roundoff(const double* x, double* out) const;
  /// |J|' e, e >= 0 by rows.
  void add_absolute(const double* e, double* out) const;

  /// Factors M + J'GJ. False if it is not positive definite to working precision; with
  /// `unsymmetric` G if it is singular. LU pivots only where without it rounding would be amplified
  /// too much.
  bool factor(const double* hessian, bool unsymmetric);
  /// x = inv(M + J'GJ) x.
  void solve(double* x) const { factorization_.solve(x); }

 private:
  /// A part of M that is not zero, and where it goes.
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
  bool mass_ready_ = false;  ///< the factorization has M as the common part
  std::vector<Block> blocks_;
  std::vector<Constraint> constraints_;
  std::vector<int> local_block_;  ///< by block of the Problem
  FrictionLanes lanes_;
  std::vector<int> single_;
  PackedJacobian jacobian_;
  std::vector<double> free_velocity_, inverse_diagonal_, bias_;
  // Groups: what the factorization has as blocks. Limbs of trees, or all in one.
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
