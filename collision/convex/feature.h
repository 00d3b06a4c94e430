// Faces, edges and corners of shapes that face each other, and the contact points between them.
//
// Given the contact normal n, each shape has a flat feature that faces the other: a convex polygon,
// a segment or a point. Projected along n, the two features intersect in a convex polygon. Its
// corners are the contact points; their gaps are the distances of the two features along n. There
// is no reference and incident face, so the rule is symmetric in A and B, and it holds for positive
// gaps and for overlap.
#pragma once

#include <array>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// A convex polygon (3 or more vertices, counter-clockwise about its outward normal), a segment (2)
/// or a point (1). For a sphere or capsule it is the feature of its core.
struct Feature {
  static constexpr int kCapacity =
      16;  // enough corners for a rim: the polygon is off the circle by 2 % of its radius
  std::array<Vector3, kCapacity> vertices;
  int size = 0;
  Vector3 normal;       ///< unit, outward; for polygons only
  double radius = 0.0;  ///< radius of the ball around each point of the core [m]
  bool round = false;   ///< true: the corners are kCapacity samples of a circle

  void add(const Vector3& v) { vertices[size++] = v; }
};

/// The closest (or deepest) points of the two cores and the contact that they make.
struct Witness {
  Vector3 point_a, point_b;        ///< on the cores [m]
  Vector3 normal;                  ///< unit, from A to B
  double distance;                 ///< signed distance of the cores along the normal [m]
  int vertex_a = 0, vertex_b = 0;  ///< for meshes: near the points, where a search may start
  bool found = true;               ///< false: the points are unknown, the distance is a lower bound
};

/// Sets `out` to the face of a box whose normal is closest to `direction`.
void box_feature(const Shape& box, const Pose& X, const Vector3& direction, Feature& out);

/// Sets `out` to a face of a mesh; if it has more than kCapacity corners, to evenly chosen ones.
void mesh_face(const ConvexMesh& mesh, int face, const Pose& X, Feature& out);

/// Sets `out` to the feature of `shape` (not a plane) that faces the unit vector `direction`.
/// `vertex`: for a mesh, where the search starts.
void support_feature(const Shape& shape, const Pose& X, const Vector3& direction, int vertex,
                     Feature& out);

/// Adds to `out` at most eight contact points with gap < margin between the features. No gap is
/// less than the witness's, and the least exceeds it by at most `tolerance` [m]: if no corner comes
/// that close, the witness is added, or nothing if its points are not found.
void feature_contacts(const Feature& a, const Feature& b, const Witness& witness, double tolerance,
                      double margin, Manifold& out);

}  // namespace counterpoint::collision
