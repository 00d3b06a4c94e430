// Weight that is carried (MJCF gravcomp): force -m g on a body, of a mass m at a point c of it.
//
// Gravity enters inverse and forward dynamics as an acceleration of the world. This force enters
// beside it, wherever something is computed under gravity: in steps, in their predicted velocities
// and in derivatives. Its potential energy is m g'c, that of the weight -m g'c (energy.h).
#pragma once

#include <span>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// The compensations of a range of bodies.
std::span<const GravityCompensation> compensations_of(const Model& model, BodyRange bodies);

/// The point that carries, from the body's origin in W [m]. Needs compute_poses.
inline Vector3 arm_of(const GravityCompensation& carried, const Kinematics& data) {
  return data.X_WB[carried.body].rotation * carried.center;
}

/// Takes the carried weight of a range of bodies out of `needed` (num_bodies): forces that
/// acceleration under gravity [m/s^2] takes, at the bodies' origins in W. Needs compute_poses.
void subtract_carried_weight(const Model& model, const Vector3& gravity, BodyRange bodies,
                             const Kinematics& data, std::vector<Force>& needed);

/// Sum of m c over the compensations of a body, in its frame [kg m].
Vector3 carried_moment(const Model& model, int body);

}  // namespace counterpoint
