// Polyhedra that approximate ellipsoids.
#pragma once

#include <memory>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// A polyhedron of 642 corners that approximates an ellipsoid.
struct RoundHull {
  std::shared_ptr<const ConvexMesh> hull;
  double error = 0.0;  ///< bound on the distance between the surfaces [m]
};

/// `half_axes`: semi-axes [m], positive.
RoundHull ellipsoid_hull(const Vector3& half_axes);

/// A note for the user on the number of corners and the error.
std::string round_hull_note(const RoundHull& round);

}  // namespace counterpoint
