// How the impulse of a contact, of drag or of a wrench changes with the motion of its bodies.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/derivatives/constraints/contact_motion.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {

/// d(stacked rows) of a motion cross product: V x m = motion_cross(V) m.
Matrix6 motion_cross(const Motion& V);
/// m x* f = carried(f) m: what a force gains when it is carried along by a displacement m.
Matrix6 carried(const Force& f);

/// The impulse W on body B at a contact's place, in W's axes, and its derivatives, 6x6 over
/// (angular, linear) at that place. `still` is what is left when the motion common to both bodies,
/// and what it carries along, is taken out:
///
///   dW = dX_A x* W + still (dX_B - dX_A) + next dV_next + v_b dV_B + v_a dV_A
///
/// dV seen from A as it moves (sweep.h has the rest).
struct PairResponse {
  Force wrench;
  Matrix6 still, next, v_a, v_b;
  Vector6 by_bias;  ///< dW by the bias of the normal row
  bool by_v = false;

  /// The part of body B on itself; that of A's on itself; of B by A's motion; of A by B's. Of the
  /// force -W on A, W on B. V_next, V_start: of body B at the contact.
  BodyResponse of_b(const Motion& V_next, const Motion& V_start) const;
  BodyResponse of_a(const Motion& V_next, const Motion& V_start) const;
  BodyResponse of_b_by_a(const Motion& V_next, const Motion& V_start) const;
  BodyResponse of_a_by_b(const Motion& V_next, const Motion& V_start) const;

  /// `still` less what the columns P of the velocities bring (sweep.h): by a displacement of B.
  Matrix6 displaced(const Motion& V_next, const Motion& V_start) const;
};

/// Bodies of a pair at its place: velocities at the end and at the start of the step, and origins
/// seen from there.
struct PairBodies {
  Motion next_a, next_b, start_a, start_b;
  Vector3 arm_a, arm_b;  ///< from the body's origin to the place [m]
};
PairBodies pair_bodies(const PairConstraint& pair, const Kinematics& data,
                       const std::vector<Motion>& V_next);

/// The columns (angular, linear) of a constraint's rows, up to six, and what its law is taken at.
struct ContactRows {
  using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, contact::kMaxRows>;
  Columns R;
  contact::Rows y;
  ContactRows(const PairConstraint& pair, const PairBodies& bodies);
};

/// The share of an impulse that counts, and how it goes with the gap, the velocity at the start of
/// the step in the contact's frame, and the normal.
struct ImpulseShare {
  double value = 1.0;
  double gap = 0.0;                  ///< [1/m]
  Vector3 v = Vector3::Zero();       ///< [s/m]
  Vector3 normal = Vector3::Zero();  ///< [-]
};

/// Of a contact in a step of h [s], the law as it is. turning: the gap is less by what the bodies'
/// turning takes from it (ConstraintFinder).
void find_contact_response(const PairConstraint& pair,
                           const PairBodies& bodies,  // Parameters: all it depends on
                           const ContactMotion& motion, const LawSlopes& law, bool turning,
                           double h, PairResponse& out, const ImpulseShare& share = {});
/// n (u_A - u_B): what that is, before it is bounded [m].
double turning_advance(const PairConstraint& pair, const PairBodies& bodies, double h);

/// Of rows whose place, frame and bias stay: what the velocity at the end makes of the impulse.
void find_velocity_response(const PairConstraint& pair, const PairBodies& bodies,
                            PairResponse& out);

}  // namespace counterpoint
