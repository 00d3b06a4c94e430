// Drag of bodies in still air, semi-implicit.
//
//   f = -(c1 + c2 |v|) v+  at the link's centre of mass,    torque = -(a1 + a2 |omega|) omega+
//
// The coefficients use the velocity at the start of the step and multiply the velocity at its end.
// This is stable for any coefficient, never adds energy, and all of it is known to the inverse. Let
// C be the spatial matrix of a body's drag: a point mass c at the centre of mass and an isotropic
// rotational inertia a. The equation of motion is
//
//   (M + h sum J'CJ) (w+ - w) = h (n + u) - h sum J'C V,       V = J w
//
// Therefore h C is added to the inertia from which the articulated-body algorithm and M are
// computed. Weight and forces quadratic in velocity must use the true inertia, but the algorithm
// multiplies its inertia by A = J a + (J' w - g), here with J' the time derivative: h C (J' w - g)
// is added as an external force to cancel that part.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// h C of every drag of the model from at.V, into external.added. Needs compute_poses and
/// compute_velocities.
void compute_drag(const Model& model, double h, const Kinematics& at, ExternalForces& external);

/// Forward: adds -C V, and the correction h C (J' w - g) above, onto external.external. Needs
/// compute_drag and compute_velocities; `acceleration` (num_bodies) is scratch.
void add_drag(const Model& model, double h, const Vector3& gravity, const Kinematics& at,
              const VelocityForces& velocity, std::vector<Motion>& acceleration,
              ExternalForces& external);

/// Inverse: adds -C V_next onto external.external; V_next (num_bodies) is V at the end of the step.
/// Needs compute_drag.
void add_drag_inverse(double h, const std::vector<Motion>& V_next, ExternalForces& external);

}  // namespace counterpoint
