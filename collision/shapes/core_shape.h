// A shape as its support function: the convex core and the radius of the ball swept over it.
#pragma once

#include <span>

#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Core of a placed shape (no plane): a sphere's is a point, a capsule's a segment; else the shape.
struct CoreShape {
  CoreShape(const Shape& s, const Pose& X_WS)
      : shape(s),
        X(X_WS),
        radius(s.type == ShapeType::kSphere || s.type == ShapeType::kCapsule ? s.size[0] : 0.0) {}

  /// A point of the core in the frame of X's parent, farthest along `direction` (any length).
  Vector3 support(const Vector3& direction) const;
  /// True if support() climbs over the edges of a mesh.
  bool climbs() const;
  /// The largest direction . x over the core, a mesh's found by looking at every vertex [m].
  double scan_support(const Vector3& direction) const;
  /// A point inside.
  Vector3 center() const;
  /// Largest distance of a core point from center(), or a bound of it [m].
  double extent() const;

  const Shape& shape;
  const Pose& X;
  double radius;
  bool scan = false;     ///< look at every vertex of a mesh instead of climbing
  mutable int hint = 0;  ///< mesh vertex last found, where the next search starts
};

/// Index of the mesh vertex farthest along `direction` (mesh frame); the search climbs from
/// `start`.
int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start);
/// Most directions of support_vertices.
inline constexpr int kSupportsAtOnce = 8;
/// The same of several directions, from one start: their first steps at once.
void support_vertices(const ConvexMesh& mesh, std::span<const Vector3> directions, int start,
                      std::span<int> vertices);
/// As support_vertex, by looking at every vertex. Of up to 128 one that is farthest to 1e-13 of the
/// radius, of more the lowest of equals.
int scan_vertices(const ConvexMesh& mesh, const Vector3& direction);

/// A vertex for support_vertex to start from: the farthest of a few that are spread over the mesh.
int likely_vertex(const ConvexMesh& mesh, const Vector3& direction);

/// Index of the face whose normal is most along the unit vector (mesh frame), to 1e-13; a search
/// among many begins around `vertex`.
int support_face(const ConvexMesh& mesh, const Vector3& direction, int vertex);

}  // namespace counterpoint::collision
