// Inverse dynamics by the recursive Newton-Euler algorithm (Featherstone 2008, table 5.1).
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Returns the force I A + V x* (I V) that gives a body with this inertia (body frame) the
/// acceleration A, in W at its origin, as are V and A. The rotational inertia stays in body axes,
/// where it is constant.
inline Force rigid_body_force(const SpatialInertia& inertia, const Matrix3& R_WB, const Motion& V,
                              const Motion& A) {
  const Vector3 center = R_WB * inertia.center;
  // Newton's law for the classical acceleration of the centre of mass; Euler's equations about it.
  const Vector3 acceleration = A.at(center) + V.angular.cross(V.at(center));
  const Vector3 omega_B = R_WB.transpose() * V.angular;
  const Vector3 torque_B = inertia.rotational * (R_WB.transpose() * A.angular) +
                           omega_B.cross(inertia.rotational * omega_B);
  const Vector3 force = inertia.mass * acceleration;
  return {R_WB * torque_B + center.cross(force), force};
}

/// Returns the force I A for a body without velocity.
inline Force rigid_body_force(const SpatialInertia& inertia, const Matrix3& R_WB, const Motion& A) {
  const Vector3 center = R_WB * inertia.center;
  const Vector3 torque_B = inertia.rotational * (R_WB.transpose() * A.angular);
  const Vector3 force = inertia.mass * A.at(center);
  return {R_WB * torque_B + center.cross(force), force};
}

/// tau = M(q) a - n(q, v) - J' f_external: the joint forces (nv) that give acceleration a (nv)
/// [rad/s^2, m/s^2] to the bodies; what acts on single coordinates (rotor inertia, damping) is the
/// caller's. gravity [m/s^2]. Needs compute_poses and compute_velocities; velocity-dependent forces
/// and external wrenches are those of `bodies`.
void rnea(const Model& model, const VectorRef& a, const Vector3& gravity, const BodyState& bodies,
          VectorOut tau);

}  // namespace counterpoint
