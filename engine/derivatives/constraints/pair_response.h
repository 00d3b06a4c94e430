// Derivatives of the impulse of a contact, of drag or of a wrench by the motion of its bodies.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/derivatives/constraints/contact_motion.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {

/// Returns the 6x6 matrix of the cross product of motions: V x m = motion_cross(V) m.
Matrix6 motion_cross(const Motion& V);
/// Returns the 6x6 matrix of m x* f = carried(f) m, the change of f when a displacement m carries
/// it along.
Matrix6 carried(const Force& f);

/// Impulse W on body B at a contact's place, in axes of the world, and its derivatives, 6x6 over
/// (angular, linear) at that place. `still` is the derivative by a displacement of B relative to A,
/// without the change of W that is carried along with A:
///
///   dW = dX_A x* W + still (dX_B - dX_A) + next dV_next + v_b dV_B + v_a dV_A
///
/// dV are changes of velocities in axes that move with A (see sweep.h).
struct PairResponse {
  Force wrench;
  Matrix6 still, next, v_a, v_b;
  Vector6 by_bias;  ///< derivative of W by the bias of the normal row
  bool by_v = false;

  /// Responses of the force W on B and -W on A: of B by its own motion, of A by its own, of B by
  /// A's, of A by B's. V_next, V_start: velocities of body B at the contact.
  BodyResponse of_b(const Motion& V_next, const Motion& V_start) const;
  BodyResponse of_a(const Motion& V_next, const Motion& V_start) const;
  BodyResponse of_b_by_a(const Motion& V_next, const Motion& V_start) const;
  BodyResponse of_a_by_b(const Motion& V_next, const Motion& V_start) const;

  /// Derivative by a displacement of B: `still` minus the contribution of the columns P (sweep.h).
  Matrix6 displaced(const Motion& V_next, const Motion& V_start) const;
};

/// Velocities of a pair's bodies at its place, at the end and at the start of the step, and the
/// place relative to their origins.
struct PairBodies {
  Motion next_a, next_b, start_a, start_b;
  Vector3 arm_a, arm_b;  ///< from the body's origin to the place [m]
};
PairBodies pair_bodies(const PairConstraint& pair, const Kinematics& data,
                       const std::vector<Motion>& V_next);

/// Columns (angular, linear) of a constraint's rows, up to six, and the argument y of its law.
struct ContactRows {
  using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, contact::kMaxRows>;
  Columns R;
  contact::Rows y;
  ContactRows(const PairConstraint& pair, const PairBodies& bodies);
};

/// Share of an impulse that counts, and its derivatives by the gap, by the velocity at the start of
/// the step in the contact's frame, and by the normal.
struct ImpulseShare {
  double value = 1.0;
  double gap = 0.0;                  ///< [1/m]
  Vector3 v = Vector3::Zero();       ///< [s/m]
  Vector3 normal = Vector3::Zero();  ///< [-]
};

/// Differentiates the impulse of a contact in a step of h [s] with its present law. turning:
/// whether turning_advance reduces the gap (ConstraintFinder).
void find_contact_response(const PairConstraint& pair, const PairBodies& bodies,
                           const ContactMotion& motion, const LawSlopes& law, bool turning,
                           double h, PairResponse& out, const ImpulseShare& share = {});
/// Returns n (u_A - u_B), the part of the gap that rotation of the bodies within the step closes,
/// before it is bounded [m].
double turning_advance(const PairConstraint& pair, const PairBodies& bodies, double h);

/// Differentiates the impulse of rows with constant place, frame and bias: only the velocity at the
/// end changes it.
void find_velocity_response(const PairConstraint& pair, const PairBodies& bodies,
                            PairResponse& out);

}  // namespace counterpoint
