// Derivatives of the displacement of bodies in addition to their velocity w+
// (overlap_correction.h): recovery of overlaps, and the part of the step before an impact.
//
// The displacement velocity p of a step that led from (q, v) to w+ solves F = 0 at constant w+,
// with
//
//   F = (M + h D) p + sum (t / h) J' f(J w+ + b)
//       - sum J_i' f_i(J_i (w+ + p) + b_i) - J_e' f_e(J_e p)
//
// where f are contacts that bounce at t(q, v), i gaps that p may close, e equalities, and D
// includes drag. Hence
//
//   dp = -inv(dF/dp) (dF/dq dq + dF/dv dv + dF/dw+ dw+)
//
// Each sum is differentiated as the inverse of a step without other forces.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/step/inverse_derivator.h"

namespace counterpoint {

class DisplacementDerivator {
 public:
  explicit DisplacementDerivator(const Model& model);

  /// Computes the results below after step_inverse with these arguments, which left constraints in
  /// `ws`. Returns false, with undefined results, if nothing is displaced or the displacement has
  /// no closed form.
  bool compute(const InverseArguments& of, Workspace::Impl& ws, InverseDerivator& parts);

  VectorX p;                      ///< displacement velocity, nv [m/s, rad/s]
  MatrixX by_q, by_v, by_v_next;  ///< derivatives of p, nv x nv, the other arguments held

 private:
  bool find(const InverseArguments& of, Workspace::Impl& ws);
  void keep_gaps(const ConstraintSet& all, const contact::Problem& problem,
                 const OverlapCorrection& correction);
  bool keep_ties(const ConstraintSet& all, bool drag);

  std::vector<Motion> V_;  ///< velocities of the bodies
  ConstraintSet kept_;
  InverseDerivatives late_, recovery_, equalities_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M_;
  MatrixX A_;
  VectorX w_, diagonal_, forces_;
  SparseSolver solver_;
};

}  // namespace counterpoint
