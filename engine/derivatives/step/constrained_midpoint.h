// Derivatives of an implicit midpoint step with constraints (midpoint.h) as a function u(q, v, v+).
// The pose at the end follows from these; it only identifies the step.
//
// With w the velocity that moves poses and m = w_m that of the smooth motion,
//
//   u = R(q, v, m),   G(q, v, m, w) = (M(q) + h D)(w - m) / h - J' f(J w + b(q, v)) / h = 0,
//   v+ = w + m - v
//
// Hence dm = dv + dv+ - dw and, with A = dG/dw - dG/dm = (2 (M + h D) + J' K J) / h,
//
//   A dw = -dG/dq dq - (dG/dv + dG/dm) dv - dG/dm dv+
//   du   = (dR/dq) dq + (dR/dv) dv + (dR/dm) dm
//
// R is differentiated as without constraints (midpoint_derivator.h), G as the inverse of an Euler
// step without other forces. Closures and mimic joints shift the velocity of R by their predicted
// impulses (velocity_predictor.h). In that case, and as a reference, u and m + w - v - v+ are
// differentiated by differences over (q, v, w, v+); the condition v + v+ - w - m = 0 gives dw.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/step/inverse_derivator.h"
#include "counterpoint/engine/derivatives/step/smooth_derivator.h"

namespace counterpoint {

class ConstrainedMidpoint {
 public:
  explicit ConstrainedMidpoint(const Model& model);

  /// Computes d in closed form, after step_inverse with these arguments and the pose at the end,
  /// which left its results in `inverted`. Returns false if something acts that has no
  /// closed form.
  bool compute(const InverseArguments& of, const InvertedStep& inverted, SmoothDerivator& smooth,
               InverseDerivator& impulses, InverseDerivatives& d);

  /// Computes d by central differences of step [m, rad]; extrapolated: from two steps. Returns
  /// false if the equation for dw is singular.
  bool difference(const InverseArguments& of, double step, bool extrapolated, Workspace& workspace,
                  InverseDerivatives& d);

  /// w (nv) of the last step, and its derivatives by q, v and v+ (nv x nv).
  VectorX w;
  MatrixX w_q, w_v, w_next;

 private:
  /// Eliminates w from the blocks by q, v, w, v+. Returns false if the equation for dw is singular.
  bool eliminate(InverseDerivatives& d);

  MatrixX by_q_, by_m_, mass_;  ///< derivatives of R; 2 / h times M at q_m
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M_;  ///< M at q
  MatrixX G_m_, A_;
  InverseDerivatives G_;
  SparseSolver solver_;
  VectorX r_, m_, diagonal_;
  // Values for the differences: u, and the residual of the condition on w.
  struct Sample {
    VectorX u, rest;
  };
  struct Block {
    MatrixX u, rest;
  };
  Block blocks_[4], wide_;  ///< derivatives by q, v, w, v+
  Sample plus_, minus_;
  VectorX at_q_, at_v_, at_w_, at_v_next_, q_next_, direction_;
  Inverse inverse_;
  std::vector<Motion> V_;  ///< velocities of the bodies at w
  ExternalForces no_external_;
};

}  // namespace counterpoint
