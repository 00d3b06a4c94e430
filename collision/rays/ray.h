// A ray against one shape, in closed form. Private: callers use collider.h.
#pragma once

#include <optional>

#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

struct RayHit;

/// Does the work of cast_ray (collider.h), for finite input and a direction of unit length.
std::optional<RayHit> cast_unit_ray(const Shape& shape, const Pose& X_WS, const Vector3& origin,
                                    const Vector3& direction, double max_distance);

/// Casts a ray on a terrain, in the terrain's frame; a ray from behind a face passes through the
/// face.
std::optional<RayHit> cast_terrain_ray(const Terrain& terrain, const Vector3& origin,
                                       const Vector3& direction, double max_distance);

/// Returns true if the first face that a ray from the point meets within max_distance [m] shows its
/// back: the point is inside the solid, or under the ground. In the terrain's frame; direction: a
/// unit vector.
bool is_behind(const Terrain& terrain, const Vector3& point, const Vector3& direction,
               double max_distance);

}  // namespace counterpoint::collision
