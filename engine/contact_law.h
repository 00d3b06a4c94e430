// From what is known at (q, w) to the law of a constraint: the one place where gaps, materials and
// options become regularizer, smoothing and bias. Forward and inverse both call it.
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Law of a contact.
/// @param pair   combined materials of the two surfaces
/// @param alpha  sum of the two bodies' inverse weights [1/kg]
/// @param gap    signed distance [m]
/// @param v      velocity of B relative to A at the contact now, in the contact frame (n, t1, t2)
/// [m/s]
contact::Law make_contact_law(const ContactOptions& options, double h, const Material& pair,
                              double alpha, double gap, const Vector3& v);

/// Law of a joint limit: gap [rad or m] to the limit, alpha the joint's inverse weight. The
/// smoothing length counts as an angle [rad] for revolute joints.
contact::Law make_limit_law(const ContactOptions& options, double h, double alpha, double gap);

/// Law of a speed limit [rad/s or m/s] of one coordinate, alpha as above. y = limit -+ w.
contact::Law make_speed_limit_law(const ContactOptions& options, double alpha, double limit);

/// Law of one coordinate of a joint with dry friction `force` [N or N m]: it takes impulses up to
/// h force. alpha as for limits.
contact::Law make_dry_friction_law(const ContactOptions& options, double h, double alpha,
                                   double force);

/// Equalities are this much more compliant than contacts: they hold bodies that move, and rounding
/// of the velocity, over the regularizer, is the error of the inverse (docs/decisions.md).
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
