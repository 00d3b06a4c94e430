// Weight that is carried (MJCF gravcomp): force -m g on a body, of a mass m at a point c of it.
//
// As gravity enters inverse and forward dynamics by the acceleration of the world, so this enters
// them beside it: whatever is computed under gravity g, the forecasts of a step and its derivatives
// too, is computed under what is left of the weight. The energy that belongs to it is m g'c,
// against -m g'c of the weight (energy.h).
#pragma once

#include <span>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Those of bodies in a range.
std::span<const GravityCompensation> compensations_of(const Model& model, BodyRange bodies);

/// The point that carries, from the body's origin in W [m]. Needs compute_poses.
inline Vector3 arm_of(const GravityCompensation& carried, const Data& data) {
  return data.X_WB[carried.body].rotation * carried.center;
}

/// Takes the carried weight of a range of bodies out of `needed` (num_bodies): forces that
/// acceleration under gravity [m/s^2] takes, at the bodies' origins in W. Needs compute_poses.
void subtract_carried_weight(const Model& model, const Vector3& gravity, BodyRange bodies,
                             const Data& data, std::vector<Force>& needed);

/// sum m c over a body's, in its frame [kg m].
Vector3 carried_moment(const Model& model, int body);

}  // namespace counterpoint
