// Smooth forces of single joint coordinates: rotor inertia, viscous damping, springs (add_springs).
//
//   armature I    I (w+ - w) / h
//   damping D     D w+                 implicit: stable at any D
//
// Forward: (M + diag(I + h D)) (w+ - w) / h = n + tau - D w. Inverse: tau = ... + I (w+ - w) / h +
// D w+.
#pragma once

#include "counterpoint/model/model.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// What the joint forces add to M, into `diagonal` [kg, kg m^2], and to the force at the start of
/// the step, onto `tau` [N, N m]; both nv. h [s].
/// Parameters: what it depends on, one by one.
void add_joint_forces(const Model& model, EffectSet effects, double h, const VectorRef& q,
                      const VectorRef& w, VectorOut diagonal, VectorOut tau, EffectCounts& counts);

/// The force that the joints took up between w and w_next, onto tau (nv) [N, N m].
void add_joint_forces_inverse(const Model& model, EffectSet effects, double h, const VectorRef& q,
                              const VectorRef& w, const VectorRef& w_next, VectorOut tau,
                              EffectCounts& counts);  // Parameters: what it depends on, one by one

}  // namespace counterpoint
