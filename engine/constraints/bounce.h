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
};

/// The impact of semi_implicit_euler falls where the parabola of the gap does. Velocities of that
/// scheme are those half a step before their poses: with v the normal velocity at (q, w) and a the
/// normal acceleration,
///
///   u = v + h a / 2,  gap + u t + a t^2 / 2 = 0,  s = -(u + a t),  w+ = e s + a (h / 2 - t)
///
/// and the impulse acts at t (overlap_correction.h): in free flight pose and velocity after the
/// step are those of the exact bounce. None where the parabola comes down again within the step:
/// then it lands. implicit_midpoint: e times the velocity now, at the start of the step.
/// @param restitution  e, > 0
/// @param gap          [m]
/// @param velocity     v [m/s], negative: closing
/// @param fall         a [m/s^2], as far as known from (q, w): gravity of what falls freely
Bounce find_bounce(Integrator integrator, double h, double restitution, double gap, double velocity,
                   double fall);

/// The acceleration by gravity [m/s^2] of each body, by index, as far as it is free to fall: that
/// of floating trees; along the axis of a prismatic joint on the world; else none is reckoned with.
std::vector<Vector3> free_fall(const Model& model);

}  // namespace counterpoint
