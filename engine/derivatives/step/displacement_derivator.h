// Derivatives of what a step displaces bodies by beside its velocity w+ (overlap_correction.h):
// recovery of overlaps, and the part of the step before an impact.
//
// The displacement velocity p of a step that led from (q, v) to w+ solves, at w+ as it is,
//
//   F = (M + h D) p + sum (t / h) J' f(J w+ + b) - sum J_i' f_i(J_i (w+ + p) + b_i) - J_e' f_e(J_e
//   p)
//
// f: contacts that bounce at t(q, v); i: gaps, which p may close; e: equalities; D with drag. So
//
//   dp = -inv(dF/dp) (dF/dq dq + dF/dv dv + dF/dw+ dw+)
//
// each sum differentiated as the inverse of a step without other forces.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/step/inverse_derivator.h"

namespace counterpoint {

class DisplacementDerivator {
 public:
  explicit DisplacementDerivator(const Model& model);

  /// After step_inverse with these arguments, which left constraints in `ws`. False if nothing is
  /// displaced, or how is not known in closed form: what is below says nothing then.
  bool compute(const InverseArguments& of, Workspace::Impl& ws, InverseDerivator& parts);

  VectorX p;                      ///< nv [m/s, rad/s]
  MatrixX by_q, by_v, by_v_next;  ///< nv x nv, each with the others held

 private:
  bool find(const InverseArguments& of, Workspace::Impl& ws);
  void keep_gaps(const Workspace::Impl& ws);
  bool keep_ties(const Workspace::Impl& ws, bool drag);

  ConstraintSet kept_;
  InverseDerivatives late_, recovery_, equalities_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M_;
  MatrixX A_;
  VectorX w_, diagonal_, forces_;
  SparseSolver solver_;
};

}  // namespace counterpoint
