// Derivatives of an implicit midpoint step with constraints (midpoint.h), as of a function u(q, v,
// v+): the pose at the end follows from these, as far as the step that it is of goes.
//
// With w the velocity that poses change by and m = w_m that of the smooth motion,
//
//   u = R(q, v, m),   G(q, v, m, w) = (M(q) + h D)(w - m) / h - J' f(J w + b(q, v)) / h = 0,
//   v+ = w + m - v
//
// so that dm = dv + dv+ - dw and, A = dG/dw - dG/dm = (2 (M + h D) + J' K J) / h,
//
//   A dw = -dG/dq dq - (dG/dv + dG/dm) dv - dG/dm dv+
//   du   = (dR/dq) dq + (dR/dv) dv + (dR/dm) dm
//
// R as without constraints (midpoint_derivator.h), G as the inverse of an Euler step without other
// forces. Closures and mimic joints shift where R is taken by what they will do
// (velocity_predictor.h): then, and as a reference, by differences of u and of m + w - v - v+, both
// by (q, v, w, v+), where v + v+ - w - m = 0 says what dw is.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/step/inverse_derivator.h"
#include "counterpoint/engine/derivatives/step/smooth_derivator.h"

namespace counterpoint {

class ConstrainedMidpoint {
 public:
  explicit ConstrainedMidpoint(const Model& model);

  /// After step_inverse with these arguments and the pose at the end, which left constraints and
  /// velocities in `ws`. False if something acts that has no closed form.
  bool compute(const InverseArguments& of, Workspace::Impl& ws, SmoothDerivator& smooth,
               InverseDerivator& impulses, InverseDerivatives& d);

  /// By central differences of step [m, rad]; extrapolated from two steps. False if they are
  /// singular.
  bool difference(const InverseArguments& of, double step, bool extrapolated, Workspace& workspace,
                  InverseDerivatives& d);

  /// nv: w, of the step that is looked at. Its derivatives by q, v and v+, nv x nv.
  VectorX w;
  MatrixX w_q, w_v, w_next;

 private:
  /// Of the blocks by q, v, w, v+, with w solved for. False where that cannot be.
  bool eliminate(InverseDerivatives& d);

  MatrixX by_q_, by_m_, mass_;  ///< of R, and 2 / h times M at q_m
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M_;  ///< at q
  MatrixX G_m_, A_;
  InverseDerivatives G_;
  SparseSolver solver_;
  VectorX r_, m_, diagonal_;
  // Of differences: u above what should vanish.
  struct Sample {
    VectorX u, rest;
  };
  struct Block {
    MatrixX u, rest;
  };
  Block blocks_[4], wide_;  ///< by q, v, w, v+
  Sample plus_, minus_;
  VectorX at_q_, at_v_, at_w_, at_v_next_, q_next_, direction_;
  Inverse inverse_;
};

}  // namespace counterpoint
