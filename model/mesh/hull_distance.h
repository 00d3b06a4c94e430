// Distance of a point from a convex hull [m].
#pragma once

#include <limits>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mesh/triangle_distance.h"

namespace counterpoint {

/// Largest signed distance of p from the planes of the faces [m]: a lower bound on its distance
/// from the hull; inside, minus its depth.
inline double excess(const ConvexMesh& hull, const Vector3& p) {
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < hull.faces.size(); ++f)
    most = std::max(most, hull.face_normals[f].dot(p) - hull.face_offsets[f]);
  return most;
}

/// Distance of p from the hull [m]; 0 inside.
inline double distance_outside(const ConvexMesh& hull, const Vector3& p) {
  if (excess(hull, p) <= 0.0) return 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const std::vector<int>& face : hull.faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      least =
          std::min(least, distance_to_triangle(p, hull.vertices[face[0]],
                                               hull.vertices[face[i - 1]], hull.vertices[face[i]]));
  return least;
}

}  // namespace counterpoint
