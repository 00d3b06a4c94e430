// Servo motors, implicit, with effort limits.
//
//   s(w+) = kp (q_t - q - h w+) + kd (w_t - w+)          servo
//   f = s + u, with an effort limit f = clamp(s + u, -E, E)
//
// q_t, w_t: targets; u: applied force of the joint. The limit applies to the motor's total force,
// so u is inside the clamp. Without a limit the servo is a spring and a damper: it adds h kd + h^2
// kp to the diagonal of M and is stable for any gains. With a limit it is a constraint row on the
// joint's coordinate,
//
//   h f = clamp(-(w+ + b) / R, -h E, h E),   R = 1 / (h kd + h^2 kp),
//   b = (kp (q - q_t) - kd w_t - u) / (kd + h kp)
//
// This is the law of dry friction with shifted velocity, without smoothing. Only the forward step
// has the row, since b contains u.
//
// Inverse: the equation of motion gives f, w+ gives s, and u = f - s. If the motor is at its limit,
// the motion implies only s + u >= E (or <= -E); the recovered u lies on the limit and gives the
// same motion.
#pragma once

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// True if the servo has an effort limit that is enabled, and therefore is a row.
bool is_limited(const Model& model, EffectSet effects, const JointServo& servo);

/// Adds the servos without limit: their terms of M to `diagonal`, and their force at the start of
/// the step to `tau` (both nv). Targets from `input`, else from the model.
void add_servos(const StepContext& at, double h, const Input& input, VectorOut diagonal,
                VectorOut tau);

/// Appends a row for each servo with a limit, except on idle bodies. Moves the applied forces of
/// these joints from `tau` (nv), which holds no other forces yet, into the rows.
void add_servo_rows(const StepContext& at, double h, const Input& input, SleepMask idle,
                    VectorOut tau, ConstraintSet& constraints);

/// Computes s(w_next) of every servo into `force` (one per servo) [N, N m].
void compute_servo_forces(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                          const Input& input, VectorOut force);

}  // namespace counterpoint
