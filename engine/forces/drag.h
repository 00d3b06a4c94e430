// Drag of bodies in still air, semi-implicit.
//
//   f = -(c1 + c2 |v|) v+  at the link's centre of mass,    torque = -(a1 + a2 |omega|) omega+
//
// The coefficients are taken with the velocity at the start of the step, the velocity that they
// multiply is that at its end: stable at any coefficient, never adds energy, and the inverse knows
// all of it. In the spatial matrix C of a body (c a point mass at the centre, a an isotropic
// rotational inertia) the equation of motion is
//
//   (M + h sum J'CJ) (w+ - w) = h (n + u) - h sum J'C V,       V = J w
//
// so h C is added to the inertia that the articulated-body sweep and M are made of, while forces
// quadratic in velocity and weight come from the true inertia: the sweep multiplies the inertia
// with A = J a + (J' w - g), so h C (J' w - g), J' the derivative, is taken back as a force.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// h C of every drag of the model from at.V, into external.added. Needs compute_poses and
/// compute_velocities.
void compute_drag(const Model& model, double h, const Kinematics& at, ExternalForces& external);

/// Forward: adds -C V and what is to be taken back onto external.external. Needs compute_drag and
/// compute_velocities; `acceleration` (num_bodies) is scratch.
void add_drag(const Model& model, double h, const Vector3& gravity, const Kinematics& at,
              const VelocityForces& velocity, std::vector<Motion>& acceleration,
              ExternalForces& external);

/// Inverse: adds -C V_next onto external.external; V_next (num_bodies) is V at the end of the step.
/// Needs compute_drag.
void add_drag_inverse(double h, const std::vector<Motion>& V_next, ExternalForces& external);

}  // namespace counterpoint
