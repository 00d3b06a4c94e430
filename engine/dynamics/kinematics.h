// Poses, motion subspaces, velocities and inertias of all bodies, in the frames of data.h.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Transforms a motion at the parent's origin to the origin of the body that is `arm` away.
inline Motion shift(const Motion& v, const Vector3& arm) { return {v.angular, v.at(arm)}; }
/// Transforms a force at a body's origin to the parent's origin, `arm` before it.
inline Force shift(const Force& f, const Vector3& arm) {
  return {f.torque + arm.cross(f.force), f.force};
}

/// Fills at.X_WB, arm, axis from q (nq), of all bodies or of a range of whole trees. Quaternions
/// must be of unit length.
void compute_poses(const Model& model, const VectorRef& q, BodyRange bodies, Kinematics& at);
inline void compute_poses(const Model& model, const VectorRef& q, Kinematics& at) {
  compute_poses(model, q, moving_bodies(model), at);
}

/// Fills at.V and c from v (nv). Needs compute_poses.
void compute_velocities(const Model& model, const VectorRef& v, BodyRange bodies, Kinematics& at);
inline void compute_velocities(const Model& model, const VectorRef& v, Kinematics& at) {
  compute_velocities(model, v, moving_bodies(model), at);
}

/// Computes V_WB of all bodies, or of a range of whole trees, at another velocity v (nv) into V
/// (num_bodies). Requires compute_poses.
void compute_body_velocities(const Model& model, const VectorRef& v, BodyRange bodies,
                             const Kinematics& at, std::vector<Motion>& V);
void compute_body_velocities(const Model& model, const VectorRef& v, const Kinematics& at,
                             std::vector<Motion>& V);

/// Computes the spatial accelerations of all bodies at constant joint velocities, without gravity,
/// into A (num_bodies). Requires compute_velocities.
void compute_velocity_accelerations(const Model& model, const Kinematics& at,
                                    std::vector<Motion>& A);
/// The same without the velocity products of bodies whose velocity-dependent force `velocity` has
/// in another form (velocity_product of data.h).
void compute_velocity_accelerations(const Model& model, const Kinematics& at,
                                    const VelocityForces& velocity, std::vector<Motion>& A);

/// Fills at.inertia. Needs compute_poses.
void compute_inertias(const Model& model, BodyRange bodies, Kinematics& at);
inline void compute_inertias(const Model& model, Kinematics& at) {
  compute_inertias(model, moving_bodies(model), at);
}

}  // namespace counterpoint
