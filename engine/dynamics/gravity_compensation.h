// Gravity compensation (MJCF gravcomp): force -m g on a body, for a mass m at a point c of the
// body.
//
// Gravity enters inverse and forward dynamics as an acceleration of the world. The compensating
// force is added wherever gravity acts: in steps, in their predicted velocities and in derivatives.
// Its potential energy is m g'c, that of the weight is -m g'c (energy.h).
#pragma once

#include <span>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Returns the compensations of a range of bodies.
std::span<const GravityCompensation> compensations_of(const Model& model, BodyRange bodies);

/// Vector from the body's origin to the point of application, in W [m]. Requires compute_poses.
inline Vector3 arm_of(const GravityCompensation& carried, const Kinematics& data) {
  return data.X_WB[carried.body].rotation * carried.center;
}

/// Subtracts the compensating forces of a range of bodies from `needed` (num_bodies): the forces
/// required for the acceleration under `gravity` [m/s^2], at the bodies' origins in W. Requires
/// compute_poses.
void subtract_carried_weight(const Model& model, const Vector3& gravity, BodyRange bodies,
                             const Kinematics& data, std::vector<Force>& needed);

/// Sum of m c over the compensations of a body, in the body frame [kg m].
Vector3 carried_moment(const Model& model, int body);

}  // namespace counterpoint
