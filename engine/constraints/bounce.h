// A contact with restitution that closes within a step: the time of the impact, and the
// normal velocity after it at the end of the step.
#pragma once

#include "counterpoint/model/scene.h"

namespace counterpoint {

/// What Newton's restitution makes of a contact in a step, judged from (q, w) alone.
struct Bounce {
  bool happens = false;
  double time = 0.0;   ///< of the impact, after the start of the step [s]
  double speed = 0.0;  ///< normal velocity w+ [m/s] that follows, positive: parting
  /// How the speed goes with what it was found from.
  double by_gap = 0.0;          ///< [1/s]
  double by_velocity = 0.0;     ///< [-]
  double by_fall = 0.0;         ///< [s]
  double by_restitution = 0.0;  ///< [m/s]
  /// How the time goes with it.
  double time_by_gap = 0.0;       ///< [s/m]
  double time_by_velocity = 0.0;  ///< [s^2/m]
  double time_by_fall = 0.0;      ///< [s^3/m]
  /// Twice the mean sliding velocity of the impact is this and that after the step (t1, t2) [m/s].
  double slide[2] = {0.0, 0.0};
  /// Of what parts: other contacts may push it back as fast as this without a force [m/s].
  double parting = 0.0;
  /// The velocity that it was found from was more than that at the contact, by Euler's equations.
  bool spins = false;
};

/// With v the normal velocity at (q, w) and a the normal acceleration, let u be the velocity of the
/// surfaces at the poses of the start: v under implicit_midpoint; v + h a / 2 under
/// semi_implicit_euler, whose velocities are those half a step before their poses.
///
/// At its time t, where semi_implicit_euler has no other contact near the two trees (alone):
///
///   gap + u t + a t^2 / 2 = 0,  s = -(u + a t),  w+ = e s + a (h / 2 - t)
///
/// and the impulse acts at t (overlap_correction.h): in free flight pose and velocity after the
/// step are those of the exact bounce. Else at the start of the step, early by t, at the gap it has
/// then and with the energy of the exact bounce:
///
///   w+ = sqrt(e^2 u^2 + 2 (1 - e^2) a gap) + h a / 2
///
/// Where that energy hardly reaches the gap, implicit_midpoint leaves more, less than e^2 u^2;
/// semi_implicit_euler takes the time of the impact. An impulse f changes the energy by f (w+ + u -
/// h a / 2 + 2 t a) / 2 <= 0 in either case, however many contacts there are. And after a bounce at
/// the start the gap is too wide for another contact to push the bodies back within the next step,
/// which would give energy. None where the parabola comes down again within the step: then it
/// lands.
/// @param restitution  e, > 0
/// @param gap          [m]
/// @param velocity     v [m/s], negative: closing
/// @param fall         a [m/s^2], as far as known from (q, w): gravity of what falls freely
Bounce find_bounce(Integrator integrator, bool alone, double h, double restitution, double gap,
                   double velocity, double fall);

/// What Euler's equations alone make of a body's angular velocity [rad/s, W], as the energy of a
/// bounce counts it: 0 but for bodies that are a tree on a floating joint.
Vector3 spin_change(const Model& model, Integrator integrator, double h, int body,
                    const Matrix3& R_WB, const Vector3& omega);

/// The acceleration by gravity [m/s^2] of each body, by index, as far as it is free to fall: that
/// of floating trees; along the axis of a prismatic joint on the world; else none is reckoned with.
std::vector<Vector3> free_fall(const Model& model);

}  // namespace counterpoint
