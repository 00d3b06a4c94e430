// A ray against one shape, in closed form. Private: callers use collider.h.
#pragma once

#include <optional>

#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

struct RayHit;

/// cast_ray of collider.h, for a direction of unit length and finite input.
std::optional<RayHit> cast_unit_ray(const Shape& shape, const Pose& X_WS, const Vector3& origin,
                                    const Vector3& direction, double max_distance);

/// The same against a terrain, all in its frame; a ray from behind a face passes through it.
std::optional<RayHit> cast_terrain_ray(const Terrain& terrain, const Vector3& origin,
                                       const Vector3& direction, double max_distance);

}  // namespace counterpoint::collision
