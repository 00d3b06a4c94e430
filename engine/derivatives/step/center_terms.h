// What derivatives of a step gain from the correction of free groups (free_groups.h), which sets
// the momentum of a group, m v_C(q+, v+) = m v_C(q, v) + h F, in place of what the step alone gives
// it.
//
// With J and H the derivatives of a group's momentum by velocities and by a displacement of q, u
// changes by J' a with a linear acceleration a of the whole group. So
//
//   inverse   du = U + J' (dF - sum U_b) / m
//             h dF = J(q+) dv+ + H(q+, v+) dq+ - J(q) dv - H(q, v) dq
//
// with U the derivatives of the step alone and U_b their rows of the forces on the bases. Poses: J
// is the derivative of m c too, so that
//
//   forward   J(q+) dq+ = J(q) dq + h m dv,   v: the velocity that c moves by (free_groups.h)
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/step/constrained_midpoint.h"
#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class CenterTerms {
 public:
  explicit CenterTerms(const Model& model);

  /// After step_inverse: the velocity (nv) that the step alone led to, before groups were
  /// corrected. Of a midpoint step also the velocities in `ws` are made those.
  const VectorX& find_step_velocity(const InverseArguments& of, Workspace::Impl& ws);

  /// Corrects the derivatives of the inverse, after step_inverse with these arguments; only
  /// d.dv_next where the others were found by differences. impulses: of a midpoint step with
  /// constraints, else null.
  void correct_inverse(const InverseArguments& of, const ConstrainedMidpoint* impulses,
                       const Workspace::Impl& ws, InverseDerivatives& d);

  /// Corrects the columns of derivatives du (nv x parameters) of the inverse of a semi-implicit
  /// step that were not found by differences of it.
  void correct_parameters(std::span<const StepParameter> parameters, const InverseArguments& of,
                          const Workspace::Impl& ws, const std::vector<char>& by_differences,
                          MatrixX& du);

  /// Corrects the derivatives of poses; of a Runge-Kutta step those of velocities too. next: the
  /// state after the step, its translations of bases do not matter.
  void correct_forward(const StepContext& at, const VectorRef& q_next, const VectorRef& v_next,
                       const Workspace::Impl& ws, ForwardDerivatives& d);

 private:
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic>;  ///< 3 x nv
  /// Of the momentum of a group [kg, kg m; kg/s, kg m/s].
  struct MomentumDerivatives {
    Rows J, H;
  };
  struct Subtree {
    double mass = 0.0;                   ///< [kg]
    Vector3 moment = Vector3::Zero();    ///< sum m r about the group's origin [kg m]
    Vector3 momentum = Vector3::Zero();  ///< [kg m/s]
  };

  void find(const Model& model, const FreeGroups::Group& group, const VectorRef& q,
            const VectorRef& v, MomentumDerivatives& out);
  void write_columns(const Model& model, const FreeGroups::Group& group, int body,
                     MomentumDerivatives& out) const;
  void add_momentum(std::span<const StepParameter> parameters, const Model& model,
                    const FreeGroups::Group& group, double factor);

  Data data_;
  std::vector<Motion> V_;
  std::vector<Subtree> subtrees_;  ///< by body: all that its joint carries
  MomentumDerivatives start_, middle_, end_;
  MatrixX rows_, by_pose_;  ///< 3 x nv
  MatrixX parameter_rows_;  ///< 3 x parameters
  VectorX w_, r_, q_;
};

}  // namespace counterpoint
