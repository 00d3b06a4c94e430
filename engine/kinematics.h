// Poses and velocities of all bodies.
#pragma once

#include "counterpoint/engine/data.h"

namespace counterpoint {

/// Fills data.X_PB and data.X_WB from q (nq). Quaternions must be unit length.
void compute_poses(const Model& model, const VectorRef& q, Data& data);

/// Fills data.V_J, V, c from v (nv); needs compute_poses.
void compute_velocities(const Model& model, const VectorRef& v, Data& data);

/// Fills data.V only, from v (nv): what contact velocities at another v need. Needs compute_poses.
void compute_body_velocities(const Model& model, const VectorRef& v, const Data& data,
                             std::vector<Motion>& V);

/// Velocity [m/s] in W of the point of `body` that is at p_W [m], from its spatial velocity V in body axes.
inline Vector3 point_velocity(const Pose& X_WB, const Motion& V, const Vector3& p_W) {
  return X_WB.rotation * (V.linear + V.angular.cross(X_WB.rotation.transpose() * (p_W - X_WB.translation)));
}

/// Column of the world-frame Jacobian of a point: velocity of the point of the subtree at p_W per unit
/// rate of coordinate j of the joint of `body`.
Vector3 point_jacobian_column(const Model& model, const Data& data, int body, int j,
                              const Vector3& p_W);

}  // namespace counterpoint
