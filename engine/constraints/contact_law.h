// Laws of constraints from (q, w): gaps, materials and options become regularizer, smoothing and
// bias here, for the forward step and the inverse. Adjusted afterwards: stiffen_closures
// (constraints.cc), contact_patch.h, friction_slip.h.
#pragma once

#include <limits>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/bounce.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Gap [m] below which two surfaces count as touching, whatever smoothing and round-off leave
/// between them.
inline double touching_gap(const ContactOptions& options) {
  return 100.0 * options.smoothing + 1e-12;
}

/// Gap [m] up to which contacts exist between bodies at rest: the distance that reach_acceleration
/// closes in a step, or the distance at which smoothing still gives 1e-6 of a body's weight; at
/// most the margin.
double resting_reach(const ContactOptions& options, double h);

/// Smoothing length [m] whose force is negligible at any distance.
inline constexpr double kHardSmoothing = 1e-13;
/// Smoothing length [m] of contacts that are open by kOpenGap [m] at least, which then need no rows
/// (parked_contacts.h). The midpoint rule gives rows to all contacts and reads their velocities off
/// rounded poses: there it is kHardSmoothing.
inline constexpr double kOpenSmoothing = 1e-15, kOpenGap = 1e-6;

/// How smoothing fades with the gap: up to `reach` [m or rad], and down to `open` [m].
struct Fading {
  double reach, open = kHardSmoothing;
};

/// Returns the smoothing length of a constraint at a gap [m or rad]. The force at a distance due to
/// smoothing fades with the gap as (1 - gap^2 / reach^2)^2 and equals that of kHardSmoothing beyond
/// the reach, so that constraints appear and vanish there, and the friction law changes, without a
/// jump. That of kHardSmoothing fades likewise within kOpenGap, to `open` at most.
double faded_smoothing(double smoothing, double gap, const Fading& fading);
/// Derivative of faded_smoothing by the gap [-].
double faded_smoothing_slope(double smoothing, double gap, const Fading& fading);
/// Derivative of faded_smoothing by the smoothing length, 0 ... 1.
double faded_smoothing_share(double smoothing, double gap, const Fading& fading);
/// Gap within which a joint limit has a row, at rest [rad or m]. It is wide, since a row is cheap
/// and solving again is not.
inline constexpr double kLimitReach = 0.1;

/// Bias [m/s] of a unilateral row at a gap [m or rad]. A positive gap may close within the step but
/// not be crossed; a penetration is recovered by the fraction `stabilization`, at most at
/// max_recovery_speed. Continuous at gap = 0.
double gap_bias(const ContactOptions& options, double h, double gap);

/// Limit of the overlap recovery by velocities, which the bodies keep after the step: kKeptRecovery
/// times max_recovery_speed, plus the velocity by which a constraint yields under kKeptWeights
/// times its design weight g / alpha (standard gravity). Faster recovery only displaces the bodies
/// (overlap_correction.h). At the defaults kKeptRecovery lets the four corners of a cube with
/// friction 0.5 carry 1.5e6 times its weight; softer contacts need kKeptWeights. Contacts of wedged
/// trees use kKeptWeights alone: with more they would press on each other with kept_recovery /
/// compliance as long as they stay wedged.
inline constexpr double kKeptRecovery = 1.95e-3;
inline constexpr double kKeptWeights = 100.0;

/// Options for the law of a contact or a joint limit (lever arm 1 m).
struct LawOptions : ContactOptions {
  /// Largest recovery speed that the bodies keep [m/s]. Equal to max_recovery_speed under the
  /// implicit midpoint rule, which takes velocities from positions and displaces nothing.
  double kept_recovery = max_recovery_speed;
  double kept_share = kKeptRecovery;       ///< part of max_recovery_speed in kept_recovery [-]
  double open_smoothing = kHardSmoothing;  ///< length where contacts are open [m]
  Fading fading() const { return {margin, open_smoothing}; }
  /// Overlaps that would need more than this recovery speed [m/s] are pushed apart less
  /// (pushed_share).
  double full_push = std::numeric_limits<double>::infinity();
};
/// Returns the options for a step with `options`; they do not depend on the load of a constraint.
/// wedged: for a contact of wedged trees (ConstraintFinder::is_wedged).
LawOptions law_options(const SimulationOptions& options, bool wedged = false);

/// Ratio full_push / kept_recovery. Smaller: rolling bodies lose energy, since their rim dips into
/// the ground each step by the height of its arc. Larger: bodies held just inside the ground keep
/// pushing.
inline constexpr double kPushed = 5.0;

/// Bias [m/s] of the unilateral row of a law: gap_bias, limited to kept_recovery pushed_share^2;
/// continuous. A body held deep inside another one, such as a robot fixed in the ground, is pushed
/// out by displacement: with recovery by velocities its contacts would press for ever with
/// kept_recovery / compliance, 1e8 N.
double law_bias(const LawOptions& options, double h, double gap);
/// Derivative of law_bias by the gap [1/s].
double law_bias_slope(const LawOptions& options, double h, double gap);
/// Ratio of full_push to the recovery speed of an overlap, at most 1.
double pushed_share(const LawOptions& options, double h, double gap);

/// Regularizer and bias of the normal row of a soft contact, f = max(0, -(v_N + bias)) /
/// regularizer, and their derivatives by the gap (one-sided at 0).
struct SoftNormal {
  double regularizer = 0.0;         ///< [1/kg]
  double bias = 0.0;                ///< [m/s]
  double regularizer_by_gap = 0.0;  ///< [1/(kg m)]
  double bias_by_gap = 0.0;         ///< [1/s]
};

/// Returns the normal row of a contact with finite stiffness k [N/m] in a step of h [s]. In
/// overlap, d < 0, it is a spring at the start of the step with a damper at its end:
///
///   F = max(0, -k d - c' v_N),   c' = sqrt(c^2 + (h k)^2),   c = damping - k dissipation d
///
/// Its impulse h F is the scalar law with regularizer 1 / (h c') and bias k d / c'. A gap, d > 0,
/// may close within the step without a force: bias d / h. The dissipation is that of Hunt and
/// Crossley, "Coefficient of restitution interpreted as damping in vibroimpact" (1975).
///
/// c' >= h k / 2 suffices for no step to gain energy, at any k, h, mass and number of contacts; h k
/// lets stiff contacts come to rest without a hop (docs/explanation/concepts.md, Soft surfaces). A
/// damper of its own much stronger than this numerical one keeps its strength.
SoftNormal soft_normal(const Spring& spring, double h, double gap);

/// Whether no rotation changes the gap of two geometries: free balls about their centre of mass,
/// against each other or against the world.
bool is_round(const Model& model, const Geometry& a, const Geometry& b);

/// Whether a contact at this gap [m] has friction in the step. meets: judged from (q, w), the
/// bodies meet within the step.
bool has_friction(const ContactOptions& options, double gap, bool meets);

/// Arguments of a contact law beside the options.
struct ContactStart {
  const Material& pair;  ///< combined materials of the two surfaces
  double alpha;          ///< sum of the two bodies' inverse weights [1/kg]
  double gap;            ///< signed distance [m]
  double area;           ///< collision::Candidate::area [m^2]
  Vector3 v;  ///< present velocity of B relative to A, in the contact frame (n, t1, t2) [m/s]
  const Bounce& bounce;  ///< result of restitution (bounce.h)
  /// Rotation does not change the gap (is_round): friction is exact beyond the margin too.
  bool round = false;
};

/// Sets the law of a contact in a step of h [s], in place. `law` must be default-constructed.
void set_contact_law(const LawOptions& options, double h, const ContactStart& start,
                     contact::Law& law);
inline contact::Law make_contact_law(const LawOptions& options, double h,
                                     const ContactStart& start) {
  contact::Law law;
  set_contact_law(options, h, start, law);
  return law;
}

/// Derivatives of a contact law's normal bias, smoothing and sliding friction by their arguments,
/// one-sided at kinks.
struct LawSlopes {
  double gap = 0.0;                    ///< bias by gap [1/s]
  Vector3 v = Vector3::Zero();         ///< bias by v [-]
  double smoothing = 0.0;              ///< Law::smoothing by gap [N]
  double softness = 0.0;               ///< Law::normal by gap [1/(kg m)]
  double fall = 0.0;                   ///< bias by the acceleration given to find_bounce [s]
  Vector3 normal = Vector3::Zero();    ///< bias by the normal, through that acceleration [m/s]
  Vector3 friction = Vector3::Zero();  ///< first sliding coefficient by v [s/m]
};
/// Derivative of gap_bias by the gap [1/s].
double gap_bias_slope(const ContactOptions& options, double h, double gap);
/// Derivatives of make_contact_law at these arguments.
LawSlopes contact_law_slopes(const LawOptions& options, double h, const ContactStart& start);

/// Law of a joint limit: gap [rad or m] to the limit, alpha the inverse weight of the joint. The
/// smoothing length counts as an angle [rad] for revolute joints.
contact::Law make_limit_law(const LawOptions& options, double h, double alpha, double gap);
/// Derivative of the Law::smoothing of make_limit_law by the gap [N or N m].
double limit_smoothing_slope(const ContactOptions& options, double alpha, double gap);

/// Law of the speed limit [rad/s or m/s] of one coordinate, y = limit -+ w. alpha as for
/// make_limit_law.
contact::Law make_speed_limit_law(const ContactOptions& options, double alpha, double limit);

/// Law of one coordinate of a joint with dry friction `force` [N or N m]: its impulse is at most h
/// force. alpha as for make_limit_law.
contact::Law make_dry_friction_law(const ContactOptions& options, double h, double alpha,
                                   double force);

/// Sets regularizer and bias of a row with given gains, without other bias: its impulse in a step
/// of h [s] is h (force - gain y), `force` [N, N m] that at y = 0, gain [N s/m, N m s/rad] > 0.
inline void set_gain(double h, double gain, double force, contact::Law& law) {
  law.regularizer = 1.0 / (h * gain);
  law.bias[0] = -force / gain;
}

/// Force of a motor [N, N m]: force - gain y, within bounds that are both finite or both infinite.
struct MotorForce {
  double force = 0.0;
  double gain = 0.0;  ///< [N s/m, N m s/rad]
  double least = 0.0, most = 0.0;
};
/// Sets the law of the row of a motor in a step of h [s].
void set_motor_law(double h, const MotorForce& motor, contact::Law& law);

/// Compliance of mimic joints and closures relative to contacts. They hold moving bodies, and the
/// error of the inverse is the rounding of the velocity over the regularizer
/// (docs/decisions/README.md).
inline constexpr double kMimicSoftness = 10.0;
inline constexpr double kClosureSoftness = 100.0;

/// Law of a mimic joint: `error` [m or rad] is recovered like a penetration.
contact::Law make_mimic_law(const ContactOptions& options, double h, double alpha, double error);

/// Law of the first `rows` (1 ... 3) rows of a closure. The bias makes the step end with the error
/// [m or rad] reduced by the recovered fraction, to second order in h; `acceleration` [m/s^2 or
/// rad/s^2] is the second time derivative of the error at constant joint velocities.
contact::Law make_closure_law(const ContactOptions& options, double h, double alpha, int rows,
                              const Vector3& error, const Vector3& acceleration);

/// Turns the law of rows of a closure into a spring k and damper d, implicit like those of joints,
///
///   f = -h (k (e + h y + h^2 / 2 e'') + d y) = -(y + b) / r
///   r = 1 / (h c), b = share (e / h + h / 2 e''), c = d + h k [N s/m], share = h k / c
///
/// with the error e and its acceleration e'' of make_closure_law.
void set_spring(double h, double c, double share, const Vector3& error, const Vector3& acceleration,
                contact::Law& law);

/// Turns the law of a closure's only row into that of a rope, which pulls with f >= 0 where the gap
/// [m], by which it is slack, closes within the step; a slack rope may become taut without a force.
/// share: of the acceleration in the bias.
void set_rope(double h, double alpha, double share, double gap, double acceleration,
              contact::Law& law);

}  // namespace counterpoint
