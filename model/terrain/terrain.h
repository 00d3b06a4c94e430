// Static triangle meshes: ground that is not convex. From mesh files and height fields.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/mesh/mesh.h"
#include "counterpoint/model/mesh/triangle_tree.h"
#include "counterpoint/model/types.h"

namespace counterpoint {

/// Triangles that push bodies off the side from which they run counter-clockwise. Made by
/// make_terrain; shared between instances. Everything in the geometry frame.
struct Terrain {
  /// How a triangle's edge is shared. At flat and concave edges bodies touch the faces only; contact
  /// with the edge itself is possible where the surface bends away from them, and at its rim.
  enum class Edge : unsigned char { kFlat, kConcave, kConvex, kRim };

  struct Triangle {
    std::array<int, 3> vertices;
    Vector3 normal;                  ///< unit, outward
    std::array<int, 3> neighbors;    ///< across the edge from vertex i to i + 1; -1 at a rim
    std::array<Edge, 3> edges;
  };

  std::vector<Vector3> vertices;  ///< [m]
  std::vector<Triangle> triangles;
  Vector3 low, high;   ///< the box around all [m]
  int dropped = 0;     ///< triangles left out: without area, or given twice
  int misfits = 0;     ///< edges where orientation changes or more than two triangles meet
  std::string source;  ///< file it came from

  /// Appends the triangles whose boxes meet the box low ... high [m], in ascending order.
  void find(const Vector3& box_low, const Vector3& box_high, std::vector<int>& out) const;

  TriangleTree tree;
  std::vector<std::vector<int>> vertex_neighbors;  ///< vertices joined by an edge
};

/// Takes the triangles as they are but for those without area and duplicates; every other edge is
/// classified by the angle between its two faces. @throws InputError (with `source`) when a
/// coordinate is not finite, an index is out of range, or no triangle is left.
std::shared_ptr<const Terrain> make_terrain(const TriangleMesh& mesh,
                                            const std::string& source = "");

}  // namespace counterpoint
