// Smooth forces of single joint coordinates: armature, viscous damping, springs (add_springs).
//
//   armature I    I (w+ - w) / h
//   damping D     D w+                 implicit: stable for any D
//
// Forward: (M + diag(I + h D)) (w+ - w) / h = n + tau - D w. Inverse: tau = ... + I (w+ - w) / h +
// D w+.
#pragma once

#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Adds the contribution of joint forces to the diagonal of M, onto `diagonal` [kg, kg m^2], and
/// their force at the start of the step, onto `tau` [N, N m]; both nv. h: duration for which they
/// act [s].
void add_joint_forces(const StepContext& at, double h, VectorOut diagonal, VectorOut tau,
                      EffectCounts& counts);

/// Adds the generalized force that the joint forces take up on the way to w_next onto tau (nv) [N,
/// N m].
void add_joint_forces_inverse(const StepContext& at, double h, const VectorRef& w_next,
                              VectorOut tau, EffectCounts& counts);

}  // namespace counterpoint
