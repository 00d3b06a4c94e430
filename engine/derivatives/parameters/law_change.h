// Derivatives of a constraint's law by the quantities it is made from (contact_law.h).
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Derivatives of the quantities that laws are made from, by one parameter.
struct LawSource {
  double compliance = 0.0, smoothing = 0.0, stabilization = 0.0, max_recovery_speed = 0.0;
  double alpha = 0.0;       ///< inverse weight of the constraint
  double slip_speed = 0.0;  ///< slip speed of exact friction (friction_slip.h)
  double fall = 0.0;        ///< acceleration that find_bounce is given
  Material material{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};  ///< combined material of the pair
};

/// Derivatives of the law by that parameter. `bias` is that of the first row, without changes of
/// gap or velocity.
struct LawChange {
  double regularizer = 0.0, normal = 0.0, smoothing = 0.0, bound = 0.0, slip_speed = 0.0,
         bias = 0.0;
  std::array<double, contact::kMaxRows - 1> friction{};
};

/// Returns the derivative of make_contact_law with these arguments.
LawChange contact_law_change(const LawOptions& law, double h, const ContactStart& start,
                             const LawSource& source);
/// Returns the derivative of make_limit_law with law_options, which made the law of `row`.
LawChange limit_law_change(const SimulationOptions& options, double alpha,
                           const JointConstraint& row, const LawSource& source);
/// Returns the derivative of laws with a bias that does not depend on the options: speed limits,
/// dry friction, equalities. law: the present one.
LawChange plain_law_change(const SimulationOptions& options, const contact::Law& law, double alpha,
                           const LawSource& source);

/// Returns the derivative of f(y); dy: derivative of y (rows) without the law's bias.
contact::Rows impulse_change(const contact::Law& law, const contact::Rows& y,
                             const contact::Rows& dy, const LawChange& change);

}  // namespace counterpoint
