// Limits of joints: positions and speeds.
//
// Joint limits: one row per limit keeps the coordinate of a limited joint on its side.
//
//   y = +- w+ + gap / h,   f >= 0
//
// The limit of a ball joint bounds the angle of its rotation vector, theta u: y = -u . w+ + gap /
// h, gap = limit - theta.
//
// A limit has a row if it is near, judged from (q, w). If an impact or a strong force drives a
// joint from afar against its limit within one step, only the velocity after the step shows it: the
// limit then gets its row and the step is solved again. The inverse knows that velocity and finds
// the same rows.
//
// Speed limits of joints: one row keeps the speed of a coordinate below v_max.
//
//   y = v_max -+ w+,   f >= 0 as for a joint limit
//
// A coordinate has a row if its speed exceeds half the limit at the start of the step, so that
// forward and inverse find the same rows; one that accelerates from below that past the limit is
// stopped in the next step. The limit is that of a motor, which gives no force beyond it, not of
// the mechanism: it is off unless a scene asks for it.
#pragma once

#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"

namespace counterpoint {

/// The coordinate of a limited joint, and the body that it moves.
struct LimitedCoordinate {
  int q_index = 0, v_index = 0, body = 0;
  double lower = 0.0, upper = 0.0;  ///< [m, rad]
  bool ball = false;                ///< a ball joint, whose angle of rotation is at most `upper`
};

/// A velocity coordinate with a speed limit [m/s, rad/s], and the body that it moves.
struct SpeedLimit {
  int v_index = 0, body = 0;
  double limit = 0.0;
};

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

/// Lists every coordinate of v whose joint has a speed limit.
std::vector<SpeedLimit> list_speed_limits(const Model& model);

/// Adds the rows to `out`, except for idle bodies (sleep.h).
void find_velocity_limits(const SimulationOptions& options, const std::vector<SpeedLimit>& limits,
                          const VectorRef& v, const InverseWeights& weights, SleepMask idle,
                          ConstraintSet& out);

}  // namespace counterpoint
