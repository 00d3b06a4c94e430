// Faces, edges and corners of shapes that face each other, and the contact points between them.
//
// Given the contact normal n, each shape shows the other a flat feature: a convex polygon, a
// segment or a point. Seen along n the two overlap in a convex polygon; its corners, with the
// distance of the two features along n as gaps, are the contact points. The rule knows no reference
// and incident face, so it is the same from both sides, and it holds for positive gaps as for
// overlap.
#pragma once

#include <array>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// A convex polygon (3 or more vertices, counter-clockwise about its outward normal), a segment (2)
/// or a point (1). A round shape shows the feature of its core.
struct Feature {
  static constexpr int kCapacity =
      16;  // corners of a rim, too: a circle is off by 2 % of its radius
  std::array<Vector3, kCapacity> vertices;
  int size = 0;
  Vector3 normal;       ///< of a polygon, unit, outward
  double radius = 0.0;  ///< of the ball around each point of the core [m]
  bool round = false;   ///< the corners are kCapacity samples of a circle

  void add(const Vector3& v) { vertices[size++] = v; }
};

/// The closest (or deepest) points of the two cores, and the contact they make.
struct Witness {
  Vector3 point_a, point_b;        ///< on the cores [m]
  Vector3 normal;                  ///< unit, from A to B
  double distance;                 ///< of the cores, along the normal [m]
  int vertex_a = 0, vertex_b = 0;  ///< of meshes: near the points, where a search may start
  bool found = true;               ///< false: the points are unknown, the distance is a lower bound
};

/// The face of a box that looks most along `direction`.
void box_feature(const Shape& box, const Pose& X, const Vector3& direction, Feature& out);

/// What `shape` (no plane) shows towards the unit vector `direction`. `vertex`: of a mesh, where
/// the search starts.
void support_feature(const Shape& shape, const Pose& X, const Vector3& direction, int vertex,
                     Feature& out);

/// Adds to `out` at most eight contact points with gap < margin between the features. No gap is
/// less than the witness's, and the least exceeds it by `tolerance` [m] at most: if no corner comes
/// so near, the witness is added, or, if its points are not found, nothing is.
void feature_contacts(const Feature& a, const Feature& b, const Witness& witness, double tolerance,
                      double margin, Manifold& out);

}  // namespace counterpoint::collision
