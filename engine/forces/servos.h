// Servo motors, implicit, with effort limits.
//
//   s(w+) = kp (q_t - q - h w+) + kd (w_t - w+)          servo
//   f = s + u, with an effort limit f = clamp(s + u, -E, E)
//
// q_t, w_t: target, u: applied force of that joint. The limit binds the motor's total, so u is
// inside the clamp. Without a limit the servo is a spring and a damper: h kd + h^2 kp on the
// diagonal of M, stable at any gains. With one it is a row on the joint's coordinate,
//
//   h f = clamp(-(w+ + b) / R, -h E, h E),   R = 1 / (h kd + h^2 kp),
//   b = (kp (q - q_t) - kd w_t - u) / (kd + h kp)
//
// which is the law of dry friction with its velocity shifted, without smoothing. The row stands in
// the forward step only: b holds u.
//
// Inverse: the equation of motion gives f, w+ gives s, and u = f - s. Where the motor is at its
// limit the motion says no more than that s + u >= E (or <= -E); the u recovered is the one that
// lies on the limit, and gives the same motion.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Is the servo a row, with an effort limit that is on?
bool is_limited(const Model& model, EffectSet effects, const JointServo& servo);

/// Servos without limit: what they add to M, onto `diagonal`, and to the force at the start of the
/// step, onto `tau` (nv both). Targets from `input`, else the model's.
void add_servos(const StepContext& at, double h, const Input& input, VectorOut diagonal,
                VectorOut tau);

/// Servos with limit: a row each. Takes the applied forces of their joints out of `tau` (nv), which
/// holds nothing else yet: they are in the rows. Of bodies that are idle there is none.
void add_servo_rows(const StepContext& at, double h, const Input& input, Idle idle, VectorOut tau,
                    std::vector<JointConstraint>& rows);

/// s(w_next) of every servo, into `force` (as many as servos) [N, N m].
void compute_servo_forces(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                          const Input& input, VectorOut force);

}  // namespace counterpoint
