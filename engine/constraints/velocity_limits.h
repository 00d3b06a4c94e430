// Speed limits of joints: a row keeps each coordinate's speed below v_max.
//
//   y = v_max -+ w+,   f >= 0 as of a joint limit
//
// For coordinates at more than half their limit at the start of the step, so that both directions
// find the same rows; what is accelerated from below that past the limit is stopped in the next
// step. It is the limit of a motor, which gives no force beyond, not of the mechanism: off unless a
// scene asks for it.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Every coordinate of v whose joint has a velocity limit.
std::vector<SpeedLimit> list_speed_limits(const Model& model);

/// Adds the rows to `out`; of bodies that are idle (sleep.h) none.
void find_velocity_limits(const SimulationOptions& options, const std::vector<SpeedLimit>& limits,
                          const VectorRef& v, const InverseWeights& weights, Idle idle,
                          ConstraintSet& out);

}  // namespace counterpoint
