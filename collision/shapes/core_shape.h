// The support function of a shape: a convex core, and the radius of the ball swept over it.
#pragma once

#include <span>

#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// The core of a placed shape (not a plane): a point for a sphere, a segment for a capsule,
/// otherwise the shape itself.
struct CoreShape {
  CoreShape(const Shape& s, const Pose& X_WS)
      : shape(s),
        X(X_WS),
        radius(s.type == ShapeType::kSphere || s.type == ShapeType::kCapsule ? s.size[0] : 0.0) {}

  /// Returns a point of the core that is farthest along `direction` (any length), in the parent
  /// frame of X.
  Vector3 support(const Vector3& direction) const;
  /// True if support() climbs along the edges of a mesh.
  bool climbs() const;
  /// Returns the largest direction . x over the core [m]; tests every vertex of a mesh.
  double scan_support(const Vector3& direction) const;
  /// Returns a point inside the core.
  Vector3 center() const;
  /// Returns an upper bound of the distance of the core's points from center() [m].
  double extent() const;

  const Shape& shape;
  const Pose& X;
  double radius;
  bool scan = false;     ///< test every vertex of a mesh instead of climbing
  mutable int hint = 0;  ///< last mesh vertex found: the start of the next search
};

/// Returns the mesh vertex farthest along `direction` (mesh frame); the search climbs from vertex
/// `start`.
int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start);
/// Largest number of directions of support_vertices.
inline constexpr int kSupportsAtOnce = 8;
/// Does the same for several directions from one start; their first steps are taken together.
void support_vertices(const ConvexMesh& mesh, std::span<const Vector3> directions, int start,
                      std::span<int> vertices);
/// Finds the farthest vertex by testing all. Up to 128 vertices: exact to 1e-13 of the radius;
/// more: exact, and the lowest index of equals.
int scan_vertices(const ConvexMesh& mesh, const Vector3& direction);

/// Returns a vertex for support_vertex to start from: the farthest of a few spread over the mesh.
int likely_vertex(const ConvexMesh& mesh, const Vector3& direction);

/// Returns the face whose normal is closest to the unit vector (mesh frame), to 1e-13; on a mesh of
/// many faces the search starts around `vertex`.
int support_face(const ConvexMesh& mesh, const Vector3& direction, int vertex);

}  // namespace counterpoint::collision
