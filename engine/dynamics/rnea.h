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

/// Computes tau = M(q) a - n(q, v) - J' f_external: the joint forces (nv) [N, N m] for the
/// acceleration a (nv) [rad/s^2, m/s^2] under gravity [m/s^2]. Forces of single coordinates (rotor
/// inertia, damping) are up to the caller. Requires compute_poses and compute_velocities; external
/// wrenches are data.external if data.has_external.
void rnea(const Model& model, const VectorRef& a, const Vector3& gravity, Data& data,
          VectorOut tau);

}  // namespace counterpoint
