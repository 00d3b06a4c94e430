// Derivatives of the law of a constraint by what it was made from (contact_law.h).
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Changes of what laws are made from, a unit of some parameter.
struct LawSource {
  double compliance = 0.0, smoothing = 0.0, stabilization = 0.0, max_recovery_speed = 0.0;
  double alpha = 0.0;                     ///< of the constraint's inverse weight
  double slip_speed = 0.0;                ///< of exact friction (friction_slip.h)
  double fall = 0.0;                      ///< of the acceleration that find_bounce is given
  Material material{0.0, 0.0, 0.0, 0.0};  ///< of the pair
};

/// And what they make of the law. `bias` is of the first row, without what comes with a gap or a
/// velocity that changes.
struct LawChange {
  double regularizer = 0.0, smoothing = 0.0, bound = 0.0, slip_speed = 0.0, bias = 0.0;
  std::array<double, contact::kMaxRows - 1> friction{};
};

/// Of make_contact_law with these arguments.
LawChange contact_law_change(const LawOptions& law, double h, const ContactStart& start,
                             const LawSource& source);
/// Of make_limit_law with law_options, the law of `row`.
LawChange limit_law_change(const SimulationOptions& options, double alpha,
                           const JointConstraint& row, const LawSource& source);
/// Of laws whose bias does not go with the options: speed limits, dry friction, equalities. law:
/// as it is.
LawChange plain_law_change(const SimulationOptions& options, const contact::Law& law, double alpha,
                           const LawSource& source);

/// What that makes of f(y), where y (rows) is changed by dy beyond the law's bias.
contact::Rows impulse_change(const contact::Law& law, const contact::Rows& y,
                             const contact::Rows& dy, const LawChange& change);

}  // namespace counterpoint
