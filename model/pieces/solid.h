// The solid that is decomposed: its surface, inside and concave edges. Private to pieces.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/model/mesh/hull_standoff.h"
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
  /// `triangles`: by which pieces are measured; `simpler`: nearly the same, which is cut; both, as
  /// all meshes, must outlive it. `around`: its hull.
  Solid(const TriangleMesh& triangles, const TriangleMesh& simpler, const ConvexMesh& around,
        double tolerance_value);

  NearestTriangle nearest;
  WindingNumber winding;
  const TriangleMesh& simple;
  NearestTriangle nearest_simple;
  WindingNumber winding_simple;
  std::vector<ReflexEdge> reflex;
  Matrix3 axes;  ///< columns: normal of the hull's largest face, its longest edge, their normal
  double size;   ///< diameter of the hull [m]
  double slack;  ///< distance below which points are one [m]
  Nearness near;
  double tolerance;  ///< [m]
  mutable Work work;

  /// Returns the distance of a point from the solid [m]; inside, 0 if the surface is farther than
  /// the tolerance.
  double distance(const Vector3& p) const;
  /// Returns the whole solid as a part.
  Part whole() const;
};

/// A part of the solid with its hull.
struct Piece {
  Part part;
  std::shared_ptr<const ConvexMesh> hull;
  /// Distance of the hull's surface from the solid [m], or a smaller one over the tolerance.
  double error = 0.0;
  Vector3 farthest = Vector3::Zero();  ///< a point of the hull as far off as that
};

/// Measures the distance of a piece's hull from the solid. Stops above the tolerance.
void measure_piece(const Solid& solid, Piece& piece);
/// Returns the point of a hull's surface farthest from the solid; the distance is at most a tenth
/// of the tolerance too large; a smaller one if it is over `enough` [m]. At least `known` [m].
/// `most`: number of points that are measured.
FarthestPoint outside_of(const Solid& solid, const ConvexMesh& hull, double known, double enough,
                         int most);

/// Returns points of a piece's hull, and below its faces, that are farther from the solid than the
/// tolerance: the one measured first, then at most about 300 more.
std::vector<Vector3> far_points(const Solid& solid, const Piece& piece);

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
