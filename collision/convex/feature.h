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

/// Addition to gaps that changes evenly over space: offset + slope . p [m].
struct GapShift {
  double offset = 0.0;
  Vector3 slope = Vector3::Zero();
  double at(const Vector3& p) const { return offset + slope.dot(p); }
};

/// Integrals over the region in which two surfaces overlap, seen along the normal n. Places are
/// along the first two columns of frame_from_normal(n) [m]; fields are the depth and the height
/// along n of the middle between the surfaces [m].
struct OverlapRegion {
  double area = 0.0;                                  ///< [m^2]
  Eigen::Vector2d place = Eigen::Vector2d::Zero();    ///< that of the place [m^3]
  Eigen::Matrix2d places = Eigen::Matrix2d::Zero();   ///< that of place place^T [m^4]
  Eigen::Vector2d fields = Eigen::Vector2d::Zero();   ///< that of the fields [m^3]
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();  ///< that of place fields^T [m^4]
};

/// Adds the region in which two polygons overlap once `shift` is added to their gaps; the depth is
/// that before the shift.
/// @param normal  unit, from A to B; polygons that are nearly edge-on add nothing
void add_overlap(const Feature& a, const Feature& b, const Vector3& normal, const GapShift& shift,
                 OverlapRegion& out);

/// Returns the integral of the depth where a polygon meets a segment or a point, or two of these
/// meet, along the unit vector `normal` from A to B [m^3].
/// @param shift    added to all gaps
/// @param radius   relative radius of curvature of the segment or point [m]; 0: sharp, with flanks
///                 of 45 degrees
/// @param has_caps the segment or point is the core of a capsule or a ball
/// @param deepest  least gap, used where no polygon meets a segment [m]
double round_overlap(const Feature& a, const Feature& b, const Vector3& normal,
                     const GapShift& shift, double radius, bool has_caps, double deepest);

/// Adds to `out` at most eight contact points with gap < margin between the features. No gap is
/// less than the witness's, and the least exceeds it by at most `tolerance` [m]: if no corner comes
/// that close, the witness is added, or nothing if its points are not found.
void feature_contacts(const Feature& a, const Feature& b, const Witness& witness, double tolerance,
                      double margin, Manifold& out);

}  // namespace counterpoint::collision
