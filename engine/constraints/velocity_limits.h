// Speed limits of joints: one row keeps the speed of a coordinate below v_max.
//
//   y = v_max -+ w+,   f >= 0 as for a joint limit
//
// A coordinate has a row if its speed exceeds half the limit at the start of the step, so that
// forward and inverse find the same rows; one that accelerates from below that past the limit is
// stopped in the next step. The limit is that of a motor, which gives no force beyond it, not of
// the mechanism: it is off unless a scene asks for it.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Lists every coordinate of v whose joint has a speed limit.
std::vector<SpeedLimit> list_speed_limits(const Model& model);

/// Adds the rows to `out`, except for idle bodies (sleep.h).
void find_velocity_limits(const SimulationOptions& options, const std::vector<SpeedLimit>& limits,
                          const VectorRef& v, const InverseWeights& weights, SleepMask idle,
                          ConstraintSet& out);

}  // namespace counterpoint
