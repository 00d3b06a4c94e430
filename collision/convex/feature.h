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

/// Sets `out` to the feature of `shape` (not a plane) that faces the unit vector `direction`.
/// `vertex`: for a mesh, where the search starts.
void support_feature(const Shape& shape, const Pose& X, const Vector3& direction, int vertex,
                     Feature& out);

/// Addition to gaps that changes evenly over space: offset + slope . p [m].
struct GapShift {
  double offset = 0.0;
  Vector3 slope = Vector3::Zero();
  double at(const Vector3& p) const { return offset + slope.dot(p); }
};

/// Region over which two features overlap, seen along the normal.
struct OverlapRegion {
  /// Area of the polygon in which they face each other; 0 if one is no polygon [m^2].
  double area = 0.0;
  double volume = 0.0;  ///< integral of the depth over the region [m^3]
  bool whole = false;   ///< they overlap in all of that polygon
  /// Centroid of that polygon along the first two columns of frame_from_normal(normal) [m].
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
};

/// Returns where two features overlap along the unit vector `normal` from A to B.
/// @param shift    added to all gaps
/// @param radius   relative radius of curvature of a segment or point [m]; 0: sharp, with flanks of
///                 45 degrees
/// @param has_caps the segment or point is the core of a capsule or a ball
/// @param deepest  least gap, used where both are segments or points [m]
OverlapRegion overlap_region(const Feature& a, const Feature& b, const Vector3& normal,
                             const GapShift& shift, double radius, bool has_caps, double deepest);

/// Adds to `out` at most eight contact points with gap < margin between the features. No gap is
/// less than the witness's, and the least exceeds it by at most `tolerance` [m]: if no corner comes
/// that close, the witness is added, or nothing if its points are not found.
void feature_contacts(const Feature& a, const Feature& b, const Witness& witness, double tolerance,
                      double margin, Manifold& out);

}  // namespace counterpoint::collision
