// The solid that is decomposed: its surface, inside and concave edges. Private to pieces.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/model/mesh/nearest_triangle.h"
#include "counterpoint/model/pieces/part.h"
#include "counterpoint/model/pieces/pieces.h"
#include "counterpoint/model/pieces/work.h"

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
  mutable Work work;

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

/// Measures the hull of a piece against the solid, from both sides: the distance of the hull's
/// surface from the solid, and that of the surfaces of `parts` from the hull's, where no plane cut
/// the piece. Stops above the tolerance.
void measure_piece(const Solid& solid, const std::vector<const Part*>& parts, Piece& piece);
/// Returns the largest distance of a hull's surface from the solid [m], at most a quarter of the
/// tolerance too large; a smaller one if it is over `enough` [m]. At least `known` [m].
double outside_of(const Solid& solid, const ConvexMesh& hull, double known, double enough);

/// Returns the plane that best cuts a piece; nothing if none has points on both sides. Leaves the
/// piece the concave edges inside its hull.
std::optional<CutPlane> best_cut(const Solid& solid, Piece& piece);

/// Joins pieces while each stays within the tolerance; beyond `most` pieces, those whose hull grows
/// least, and only those once the solid's work is over `most_work`.
void join_pieces(const Solid& solid, int most, std::size_t most_work, std::vector<Piece>& pieces);

/// Measures how far the surfaces of the pieces' union and of a mesh stand apart; the distance from
/// the union is that from the solid.
void measure_pieces(const Solid& solid, const TriangleMesh& mesh, Pieces& out);

/// Returns the hull of a part; null if it has no volume.
std::shared_ptr<const ConvexMesh> hull_of(const std::vector<Vector3>& points,
                                          const std::string& source);

}  // namespace counterpoint::pieces
