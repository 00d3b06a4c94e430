// A contact candidate: where two geometries touch, overlap, or come close.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {

/// All in the world frame W. Geometry A has the lower index.
struct Candidate {
  int geometry_a = 0, geometry_b = 0;
  Vector3 position = Vector3::Zero();  ///< halfway between the two surface points [m]
  Vector3 normal = Vector3::UnitZ();   ///< unit, from A to B
  double gap = 0.0;                    ///< signed distance along the normal [m]; negative: overlap
};

}  // namespace counterpoint::collision
