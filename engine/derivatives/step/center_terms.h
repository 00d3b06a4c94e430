// Derivatives of the correction of free groups (free_groups.h), which sets the momentum of a group
// to m v_C(q+, v+) = m v_C(q, v) + h F instead of the momentum that the step alone gives.
//
// With J and H the derivatives of a group's momentum by velocities and by a displacement of q, a
// linear acceleration a of the whole group changes u by J' a. Hence
//
//   inverse   du = U + J' (dF - sum U_b) / m
//             h dF = J(q+) dv+ + H(q+, v+) dq+ - J(q) dv - H(q, v) dq
//
// where U are the derivatives of the step alone and U_b their rows of the forces on the bases. J is
// also the derivative of m c, c the centre of mass, by a displacement of q, so that poses satisfy
//
//   forward   J(q+) dq+ = J(q) dq + h m dv,   v: the velocity that moves c (free_groups.h)
#pragma once

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/derivatives/step/constrained_midpoint.h"

namespace counterpoint {

class CenterTerms {
 public:
  explicit CenterTerms(const Model& model);

  /// Returns the velocity (nv) that the step alone led to, before groups were corrected; call it
  /// after step_inverse. Corrects the velocities of the inverse, and w_m (nv) of a midpoint step,
  /// accordingly. at: kinematics at (q, v).
  const VectorX& find_step_velocity(const InverseArguments& of, const FreeGroups& groups,
                                    const Kinematics& at, InverseScratch& inverse, VectorX& w_m);

  /// Corrects the derivatives of the inverse, after step_inverse with these arguments; only
  /// d.dv_next if the others were found by differences. impulses: set for a midpoint step with
  /// constraints, else null.
  void correct_inverse(const InverseArguments& of, const ConstrainedMidpoint* impulses,
                       const InvertedStep& inverted, InverseDerivatives& d);

  /// Corrects those columns of du (nv x parameters), of the inverse of a semi-implicit Euler step,
  /// that were not found by differences of the whole step.
  void correct_parameters(std::span<const StepParameter> parameters, const InverseArguments& of,
                          const InvertedStep& inverted, const std::vector<char>& by_differences,
                          MatrixX& du);

  /// Corrects the derivatives of poses; for a Runge-Kutta step those of velocities too. q_next,
  /// v_next: the state after the step, whose translations of bases do not matter.
  void correct_forward(const StepContext& at, const VectorRef& q_next, const VectorRef& v_next,
                       const FreeGroups& groups, ForwardDerivatives& d);

 private:
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic>;  ///< 3 x nv
  /// Derivatives of the momentum of a group: J [kg, kg m] and H [kg/s, kg m/s].
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
  std::vector<Subtree> subtrees_;  ///< per body: everything that its joint carries
  MomentumDerivatives start_, middle_, end_;
  MatrixX rows_, by_pose_;  ///< 3 x nv
  MatrixX parameter_rows_;  ///< 3 x parameters
  VectorX w_, r_, q_;
};

}  // namespace counterpoint
