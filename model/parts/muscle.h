// Muscles: the force along a muscle-tendon unit as a function of activation, length and speed.
#pragma once

namespace counterpoint {

/// A muscle whose tendon is rigid, and the dynamics of its activation. Lengths are those of the
/// whole unit (fibre and tendon); all forces pull.
struct Muscle {
  enum class Curves : unsigned char {
    kMujoco,   ///< the curves of MuJoCo's muscles
    kMillard,  ///< Millard, Uchida, Seth, Delp 2013, with the rigid tendon of their section 2.2
  };
  Curves curves = Curves::kMillard;
  double max_force = 0.0;       ///< isometric force at the optimal length, active [N]
  double optimal_length = 0.0;  ///< length of the fibre of the largest active force [m]
  double slack_length = 0.0;    ///< length of the tendon [m]
  double pennation = 0.0;       ///< angle between fibre and tendon at the optimal length [rad]
  double max_speed = 10.0;      ///< largest shortening speed [optimal lengths per second]
  double damping = 0.1;  ///< of the fibre, times max_force and speed over max_speed [-]; kMillard
  /// Fibre lengths over the optimal one between which active force acts [-]; kMujoco.
  double shortest = 0.5, longest = 1.6;
  double passive_force = 1.3;    ///< over max_force, at `longest` [-]; kMujoco
  double eccentric_force = 1.2;  ///< largest, of a lengthening fibre, over max_force [-]; kMujoco
  double activation_time = 0.01, deactivation_time = 0.04;  ///< [s]
  double activation_smoothing = 0.0;  ///< width of the transition between the two [-]
};

/// Force of a muscle [N], positive: it pulls, with derivatives.
struct MuscleForce {
  double force = 0.0;
  double by_length = 0.0;      ///< [N/m]
  double by_speed = 0.0;       ///< [N s/m], not negative
  double by_activation = 0.0;  ///< [N]
};

/// Returns the force at an activation (0 ... 1), a length [m] and a lengthening speed [m/s] of the
/// whole unit. Finite for all finite arguments.
MuscleForce muscle_force(const Muscle& muscle, double activation, double length, double speed);

/// Returns the activation h [s] later under a constant excitation, clamped to 0 ... 1.
double next_activation(const Muscle& muscle, double activation, double excitation, double h);

}  // namespace counterpoint
