// Joint limits: one row per limit keeps the coordinate of a limited joint on its side.
//
//   y = +- w+ + gap / h,   f >= 0
//
// A limit has a row if it is near, judged from (q, w). If an impact or a strong force drives a
// joint from afar against its limit within one step, only the velocity after the step shows it: the
// limit then gets its row and the step is solved again. The inverse knows that velocity and finds
// the same rows.
#pragma once

#include <vector>

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Lists the coordinates with at least one finite limit.
std::vector<LimitedCoordinate> list_limited_coordinates(const Model& model);

/// Adds a row for every limit of the coordinates `limited` that is near at q, v, except for idle
/// bodies (sleep.h).
void find_joint_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                       const InverseWeights& weights, SleepMask idle, ConstraintSet& out);

/// Adds a row for every limit without one that the velocity w (nv) reaches within a time step from
/// q, v. Returns false if none was added.
bool find_overrun_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                         const VectorRef& w, const InverseWeights& weights, SleepMask idle,
                         ConstraintSet& out);

}  // namespace counterpoint
