// Restitution: the time of impact of a contact that closes within a step, and its normal velocity
// at the end of the step.
#pragma once

#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Result of Newton's restitution for a contact in a step, from (q, w) alone.
struct Bounce {
  bool happens = false;
  double time = 0.0;   ///< time of impact after the start of the step [s]
  double speed = 0.0;  ///< normal velocity w+ at the end of the step [m/s], positive: separating
  /// Derivatives of `speed` by gap, normal velocity, normal acceleration and coefficient of
  /// restitution.
  double by_gap = 0.0;          ///< [1/s]
  double by_velocity = 0.0;     ///< [-]
  double by_fall = 0.0;         ///< [s]
  double by_restitution = 0.0;  ///< [m/s]
  /// Derivatives of `time` by the same quantities.
  double time_by_gap = 0.0;       ///< [s/m]
  double time_by_velocity = 0.0;  ///< [s^2/m]
  double time_by_fall = 0.0;      ///< [s^3/m]
  /// slide + (tangential velocity after the step) is twice the mean sliding velocity of the impact
  /// (t1, t2) [m/s].
  double slide[2] = {0.0, 0.0};
  /// Separating contact: other contacts may push it back at up to this speed without a contact
  /// force [m/s].
  double parting = 0.0;
  /// The velocity used includes a rotation by Euler's equations (spin_change).
  bool spins = false;
};

/// Let v be the normal velocity at (q, w), a the normal acceleration, and u the velocity of the
/// surfaces at the initial poses: u = v under implicit_midpoint; u = v + h a / 2 under
/// semi_implicit_euler, whose velocities are half a step earlier than its poses.
///
/// If `alone` (no other contact near the two trees) under semi_implicit_euler, the impact has its
/// true time t:
///
///   gap + u t + a t^2 / 2 = 0,  s = -(u + a t),  w+ = e s + a (h / 2 - t)
///
/// and the impulse acts at t (overlap_correction.h): in free flight, pose and velocity after the
/// step are those of the exact bounce. Otherwise the impact is at the start of the step, early by
/// t, at the initial gap and with the energy of the exact bounce:
///
///   w+ = sqrt(e^2 u^2 + 2 (1 - e^2) a gap) + h a / 2
///
/// If the fall across the gap takes most of that energy, implicit_midpoint leaves more of it, less
/// than e^2 u^2; semi_implicit_euler then uses the time of impact. In either case an impulse f
/// changes the energy by f (w+ + u - h a / 2 + 2 t a) / 2 <= 0, for any number of contacts. After a
/// bounce at the start the gap is too wide for another contact to push the bodies back within the
/// next step, which would add energy. Nothing bounces if the parabola comes down again within the
/// step: the body then lands.
/// @param restitution  e, > 0
/// @param gap          [m]
/// @param velocity     v [m/s], negative: closing
/// @param fall         a [m/s^2] as known from (q, w): that of free_fall
Bounce find_bounce(Integrator integrator, bool alone, double h, double restitution, double gap,
                   double velocity, double fall);

/// Change of a body's angular velocity [rad/s, W] by Euler's equations alone, as it enters the
/// energy of a bounce; 0 unless the body is a whole tree on a floating joint.
Vector3 spin_change(const Model& model, Integrator integrator, double h, int body,
                    const Matrix3& R_WB, const Vector3& omega);

/// Free-fall acceleration [m/s^2] of each body, by index: gravity for trees on a floating joint;
/// its component along the axis for a single body on a prismatic joint to the world without spring
/// or servo; else 0.
std::vector<Vector3> free_fall(const Model& model);

}  // namespace counterpoint
