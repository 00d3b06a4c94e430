// Ellipsoids as polyhedra.
#pragma once

#include <memory>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// An ellipsoid as a polyhedron of 642 corners.
struct RoundHull {
  std::shared_ptr<const ConvexMesh> hull;
  double error = 0.0;  ///< its surface lies within this of the ellipsoid's, either way [m]
};

/// `half_axes` [m], positive.
RoundHull ellipsoid_hull(const Vector3& half_axes);

/// What a reader must know about it: how near it is.
std::string round_hull_note(const RoundHull& round);

}  // namespace counterpoint
