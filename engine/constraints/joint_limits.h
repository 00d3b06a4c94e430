// Joint limits: a row keeps each coordinate of a limited joint on its side.
//
//   y = +- w+ + gap / h,   f >= 0
//
// A limit has a row if it is near as judged from (q, w). A joint that an impact or a strong force
// drives against a limit from afar within one step is seen only in the velocity after the step:
// then the limit gets its row and the step is solved again. The inverse knows that velocity and
// finds the same rows.
#pragma once

#include <vector>

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Those with a bound on one side at least.
std::vector<LimitedCoordinate> list_limited_coordinates(const Model& model);

/// Adds a row for every limit of the coordinates `limited` that is near at q, v; of bodies that are
/// idle (sleep.h) none.
void find_joint_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                       const InverseWeights& weights, Idle idle, ConstraintSet& out);

/// Adds a row for every limit that has none yet though the velocity w (nv) for one time step leads
/// to it or past it from q, v. False if there was none to add.
bool find_overrun_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                         const VectorRef& w, const InverseWeights& weights, Idle idle,
                         ConstraintSet& out);

}  // namespace counterpoint
