// From what is known at (q, w) to the law of a constraint: the one place where gaps, materials and
// options become regularizer, smoothing and bias. Forward and inverse both call it.
#pragma once

#include <limits>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/bounce.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Nearer than this [m] surfaces touch, whatever smoothing and round-off leave between them.
inline double touching_gap(const ContactOptions& options) {
  return 100.0 * options.smoothing + 1e-12;
}

/// The gap [m] up to which contacts exist between bodies at rest: what reach_acceleration closes in
/// a step, or where smoothing still gives 1e-6 of a body's weight; no more than the margin.
double resting_reach(const ContactOptions& options, double h);

/// The smoothing length of a constraint at a gap [m or rad]. The force at a distance that it makes
/// fades with the gap, (1 - gap^2 / reach^2)^2, and is that of kHardSmoothing from the reach on:
/// constraints appear and vanish there, and friction is another law, without a jump.
double faded_smoothing(double smoothing, double gap, double reach);
/// Its derivative by the gap [-].
double faded_smoothing_slope(double smoothing, double gap, double reach);
/// Its derivative by the smoothing length, 0 ... 1.
double faded_smoothing_share(double smoothing, double gap, double reach);
/// What is no longer felt at any distance [m].
inline constexpr double kHardSmoothing = 1e-13;
/// Joint limits have rows from here on, at rest [rad or m]: wide, since a row is cheap and a second
/// solution is not.
inline constexpr double kLimitReach = 0.1;

/// Bias [m/s] of a unilateral row at a gap [m or rad]: a gap may be closed within the step but not
/// crossed; a share of an overlap is recovered, no faster than max_recovery_speed. Continuous at
/// gap = 0.
double gap_bias(const ContactOptions& options, double h, double gap);

/// An overlap is recovered by velocities, which bodies keep, up to this share of max_recovery_speed
/// and by what a constraint gives under this many times the weight that it was made for,
/// standard gravity on 1 / alpha. What is faster only displaces the bodies (overlap_correction.h).
/// The share lets the four corners of a cube of friction 0.5 carry 1.5e6 times its weight at the
/// defaults; softer contacts need the weights. Contacts of what is wedged have these alone: they
/// would push each other with kept_recovery over compliance for as long as it is.
inline constexpr double kKeptRecovery = 1.95e-3;
inline constexpr double kKeptWeights = 100.0;

/// The options that the law of a contact or a joint limit (lever 1 m) is made with.
struct LawOptions : ContactOptions {
  /// Of the recovery of an overlap, what may be kept [m/s]: max_recovery_speed under the implicit
  /// midpoint rule, which reads velocities off positions and displaces nothing.
  double kept_recovery = max_recovery_speed;
  double kept_share = kKeptRecovery;  ///< of max_recovery_speed, in it
  /// Overlaps whose recovery in a step takes more than this [m/s] are pushed apart by less.
  double full_push = std::numeric_limits<double>::infinity();
};
/// In a step by `integrator`: the same whatever a constraint carries. wedged: of a contact of trees
/// that are (ConstraintFinder::is_wedged).
LawOptions law_options(const SimulationOptions& options, bool wedged = false);

/// full_push is so many times kept_recovery. Less, and what rolls, whose rim is in the ground after
/// each step by the height of its arc, loses more energy; more, and what is held nearly free of the
/// ground pushes on.
inline constexpr double kPushed = 5.0;

/// Bias [m/s] of a law's unilateral row: gap_bias, no faster than kept_recovery pushed_share^2.
/// What is held deep inside another, as a robot fixed in the ground, is pushed out by displacement:
/// by velocities its contacts would push each other with kept_recovery over compliance, 1e8 N, for
/// ever. Continuous.
double law_bias(const LawOptions& options, double h, double gap);
/// By the gap [1/s].
double law_bias_slope(const LawOptions& options, double h, double gap);
/// full_push over the recovery of an overlap, at most 1.
double pushed_share(const LawOptions& options, double h, double gap);

/// Whether no turning changes the gap of two geometries: free balls about their centre of mass, and
/// one of these with the world.
bool is_round(const Model& model, const Geometry& a, const Geometry& b);

/// Whether a contact at this gap [m] has friction in the step; meets: as judged from (q, w) the
/// bodies meet within it.
bool rubs(const ContactOptions& options, double gap, bool meets);

/// What the law of a contact is made from, beside options.
struct ContactStart {
  const Material& pair;  ///< combined materials of the two surfaces
  double alpha;          ///< sum of the two bodies' inverse weights [1/kg]
  double gap;            ///< signed distance [m]
  Vector3 v;             ///< of B relative to A at the contact now, in its frame (n, t1, t2) [m/s]
  const Bounce& bounce;  ///< what restitution makes of it
  /// The gap does not go by how the bodies turn: friction is exact beyond the margin too.
  bool round = false;
};

/// Law of a contact in a step of h [s], where it is made: into that of a constraint just begun, all
/// at its defaults.
void set_contact_law(const LawOptions& options, double h, const ContactStart& start,
                     contact::Law& law);
inline contact::Law make_contact_law(const LawOptions& options, double h,
                                     const ContactStart& start) {
  contact::Law law;
  set_contact_law(options, h, start, law);
  return law;
}

/// How the bias of a contact law's normal row, and its smoothing, change with what they were made
/// from, one-sided at their kinks.
struct LawSlopes {
  double gap = 0.0;             ///< of the bias [1/s]
  Vector3 v = Vector3::Zero();  ///< of the bias by v [-]
  double smoothing = 0.0;       ///< of Law::smoothing by the gap [N]
  double fall = 0.0;            ///< of the bias by the acceleration that find_bounce was given [s]
  Vector3 normal = Vector3::Zero();  ///< of the bias by the normal, through that [m/s]
};
/// Of gap_bias [1/s].
double gap_bias_slope(const ContactOptions& options, double h, double gap);
/// Of make_contact_law with these arguments.
LawSlopes contact_law_slopes(const LawOptions& options, double h, const ContactStart& start);

/// Law of a joint limit: gap [rad or m] to the limit, alpha the joint's inverse weight. The
/// smoothing length counts as an angle [rad] for revolute joints.
contact::Law make_limit_law(const LawOptions& options, double h, double alpha, double gap);
/// Of its Law::smoothing by the gap [N or N m].
double limit_smoothing_slope(const ContactOptions& options, double alpha, double gap);

/// Law of a speed limit [rad/s or m/s] of one coordinate, alpha as above. y = limit -+ w.
contact::Law make_speed_limit_law(const ContactOptions& options, double alpha, double limit);

/// Law of one coordinate of a joint with dry friction `force` [N or N m]: it takes impulses up to
/// h force. alpha as for limits.
contact::Law make_dry_friction_law(const ContactOptions& options, double h, double alpha,
                                   double force);

/// Equalities are this much more compliant than contacts: they hold bodies that move, and rounding
/// of the velocity, over the regularizer, is the error of the inverse (docs/decisions/README.md).
inline constexpr double kMimicSoftness = 10.0;
inline constexpr double kClosureSoftness = 100.0;

/// Law of a mimic joint: `error` [m or rad] is recovered like a penetration.
contact::Law make_mimic_law(const ContactOptions& options, double h, double alpha, double error);

/// Law of the first `rows` (1 ... 3) rows of a closure. The bias lets the step end with the error
/// [m or rad] less the share recovered, to second order in h: `acceleration` [m/s^2 or rad/s^2] is
/// that of the error at constant joint velocities.
contact::Law make_closure_law(const ContactOptions& options, double h, double alpha, int rows,
                              const Vector3& error, const Vector3& acceleration);

}  // namespace counterpoint
