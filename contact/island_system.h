// One island of a Problem, packed for the inner loops of the solver: local numbering, Jacobians
// without their zero columns, the block structure of M + J'GJ and its factorization.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/contact/block_factorization.h"
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
    int column;           ///< first entry in columns_
    int num_columns;      ///< of both sides; those of side 0 come first
    int split;            ///< number of columns of side 0
    int jacobian;         ///< start in jacobian_: rows x num_columns, column-major
    int hessian;          ///< start of its G among all G, row-major
    int group[2];         ///< factorization block of each side; -1 if none
    BlockFactorization::Block target[3];  ///< (0, 0), (1, 1), off-diagonal
    bool swapped;  ///< the off-diagonal block is stored with side 1 as its rows
  };

  /// Blocks and constraints in increasing order. The problem must outlive its use here.
  void load(const Problem& problem, std::span<const int> blocks, std::span<const int> constraints,
            Factorization factorization);

  int size() const { return size_; }
  int num_rows() const { return num_rows_; }
  /// Doubles needed for all G.
  int hessian_size() const { return hessian_size_; }
  const std::vector<Constraint>& constraints() const { return constraints_; }
  std::vector<Constraint>& constraints() { return constraints_; }
  const double* free_velocity() const { return free_velocity_.data(); }
  /// 1 / M_ii.
  const double* inverse_diagonal() const { return inverse_diagonal_.data(); }
  /// Some law is `coulomb` now.
  bool unsymmetric() const;
  /// All M_ii are positive.
  bool diagonal_positive() const { return diagonal_positive_; }

  void gather(const double* global, double* local) const;
  void scatter(const double* local, double* global) const;

  /// out = M x.
  void multiply_mass(const double* x, double* out) const;
  /// out = J x.
  void multiply_jacobian(const double* x, double* out) const;
  /// out = J x + b, in one fixed order of summation.
  void constraint_velocity(const double* x, double* out) const;
  /// out += J' f; returns the sum over constraints of |J_c' f_c|^2 in the norm of inv(diag M).
  double add_impulse(const double* f, double* out) const;
  /// A bound on the round-off of y = J x + b, row by row.
  void velocity_roundoff(const double* x, double* out) const;
  /// |J|' e, e >= 0 by rows.
  void add_absolute(const double* e, double* out) const;

  /// Factors M + J'GJ. False if it is not positive definite to working precision; with
  /// `unsymmetric` G if it is singular.
  bool factor(const double* hessian, bool unsymmetric);
  /// x = inv(M + J'GJ) x.
  void solve(double* x) const { factorization_.solve(x); }

 private:
  struct Block {
    int start;  ///< local
    int size;
    int global_start;
    const double* mass;
    int group, offset;  ///< factorization block, and place inside it
  };
  void load_blocks(const Problem& problem, std::span<const int> blocks);
  void load_constraints(const Problem& problem, std::span<const int> constraints);
  void pack_side(const Problem& problem, int constraint, int side, int start);
  void estimate_inverse_masses();
  void analyze(Factorization factorization);
  void add_mass();
  void add_hessian(const Constraint& c, const double* g, bool unsymmetric);

  int size_ = 0, num_rows_ = 0, hessian_size_ = 0;
  bool diagonal_positive_ = true, dense_ = true;
  std::vector<Block> blocks_;
  std::vector<Constraint> constraints_;
  std::vector<int> local_block_;      ///< by block of the Problem
  std::vector<int> columns_;          ///< local velocity index of every packed column
  std::vector<int> places_;           ///< the same inside its factorization block
  std::vector<double> row_jacobian_;  ///< jacobian_ with each constraint's part row-major
  std::vector<double> jacobian_, free_velocity_, inverse_diagonal_;
  std::vector<int> group_sizes_;
  BlockFactorization factorization_;
};

}  // namespace counterpoint::contact
