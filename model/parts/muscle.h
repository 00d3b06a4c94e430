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
  double slack_length = 0.0;    ///< length of the tendon [m]; kMujoco: may be negative
  double pennation = 0.0;       ///< angle between fibre and tendon at the optimal length [rad]
  double max_speed = 10.0;      ///< largest shortening speed [optimal lengths per second]
  double damping = 0.1;         ///< fibre force over max_force at max_speed [-]; kMillard
  /// Fibre lengths over the optimal one between which active force acts [-]; kMujoco.
  double shortest = 0.5, longest = 1.6;
  /// Passive force over max_force, twice that midway between 1 and `longest` [-]; kMujoco.
  double passive_force = 1.3;
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

/// Returns the force at an activation (clamped to 0 ... 1), a length [m] and a lengthening speed
/// [m/s] of the whole unit, with derivatives. Finite for all finite arguments. With F = max_force,
/// x = (length - slack_length) / optimal_length and v = speed / (optimal_length max_speed):
///
///   kMujoco    F (a FL(x) FV(v) + FP(x)), parabolas and lines, once differentiable
///   kMillard   F p((a fl(L) fv(V) + fp(L) + damping V) cos s(x)), twice differentiable,
///              L = sqrt(x^2 + sin(pennation)^2), cos = x / L, V = v cos
///
/// fl, fv, fp are the quintic Bezier curves with the default parameters of OpenSim's muscle of this
/// name and no smallest active force; beyond their ends they go on along their tangents. p is 0 for
/// forces that push and the identity above 0.01; s rises from 0 to 1 between x = 0 and 0.1.
/// docs/reference/muscles.md has all formulas.
MuscleForce muscle_force(const Muscle& muscle, double activation, double length, double speed);

/// Returns the activation h [s] later under a constant excitation, both clamped to 0 ... 1:
/// da/dt = (u - a) / tau(u, a), with tau = activation_time (0.5 + 1.5 a) if u > a, else
/// deactivation_time / (0.5 + 1.5 a). It is an exponential with tau at the middle of the step: of
/// second order, and between a and u for every h.
double next_activation(const Muscle& muscle, double activation, double excitation, double h);

}  // namespace counterpoint
