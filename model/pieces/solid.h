// The solid that is decomposed: its surface, inside and concave edges. Private to pieces.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/model/mesh/nearest_triangle.h"
#include "counterpoint/model/pieces/part.h"
#include "counterpoint/model/pieces/pieces.h"

namespace counterpoint::pieces {

/// An edge at which the solid's surface bends inwards, between faces of normals a and b.
struct ReflexEdge {
  Vector3 from, to, normal_a, normal_b;
};

/// Returns the concave edges between two triangles, in the order of the triangles.
std::vector<ReflexEdge> reflex_edges(const TriangleMesh& mesh);

struct Solid {
  Solid(const TriangleMesh& triangles, const ConvexMesh& around, double tolerance_value);

  const TriangleMesh& mesh;
  NearestTriangle nearest;
  WindingNumber winding;
  std::vector<ReflexEdge> reflex;
  Matrix3 axes;      ///< columns: normal of the hull's largest face, its longest edge, their normal
  double size;       ///< diameter of the hull [m]
  double slack;      ///< distance below which points are one [m]
  double tolerance;  ///< [m]

  /// True for a point of the mesh with the solid on both sides, where closed bodies overlap;
  /// `normal`: of its triangle.
  bool is_buried(const Vector3& p, const Vector3& normal) const;
  /// Returns the whole solid as a part.
  Part whole() const;
};

/// A part of the solid with its hull.
struct Piece {
  Part part;
  std::shared_ptr<const ConvexMesh> hull;
  double error = 0.0;  ///< distance between hull and part [m], or a smaller one over the tolerance
};

/// Largest distance between the hull and the part of a solid, from both sides [m]: of the hull's
/// surface from the solid, and of the part's surface from the hull's, where no plane cut it.
double piece_error(const Solid& solid, const Part& part, const ConvexMesh& hull);

/// Returns the plane that best cuts a piece; nothing if none has points on both sides.
std::optional<CutPlane> best_cut(const Solid& solid, const Piece& piece);

/// Joins pieces while each stays within the tolerance; beyond `most` pieces, those whose hull grows
/// least.
void join_pieces(const Solid& solid, int most, std::vector<Piece>& pieces);

/// Measures how far the surfaces of union and mesh stand apart.
void measure_pieces(const Solid& solid, Pieces& out);

/// Returns the hull of a part; null if it has no volume.
std::shared_ptr<const ConvexMesh> hull_of(const std::vector<Vector3>& points,
                                          const std::string& source);

}  // namespace counterpoint::pieces
