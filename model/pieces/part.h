// The part of a solid within a convex cell, which planes have cut out of it. Private to pieces.
//
// The extreme points of a part are corners of its clipped surface, or corners of the cell inside
// the solid. Therefore its hull needs no triangles on the planes that cut it.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/pieces/winding_number.h"

namespace counterpoint::pieces {

/// The plane normal . x = offset; `normal` has unit length.
struct CutPlane {
  Vector3 normal = Vector3::UnitZ();
  double offset = 0.0;  ///< [m]

  double height(const Vector3& p) const { return normal.dot(p) - offset; }
};

using Corners3 = std::array<Vector3, 3>;

/// A convex polyhedron as its faces.
struct Cell {
  std::vector<std::vector<Vector3>> faces;

  /// Returns the corners of the polygon in which the plane cuts the cell; not in order.
  std::vector<Vector3> section(const CutPlane& plane) const;
  /// Keeps the points below the plane.
  void cut(const CutPlane& plane);
  /// Returns the corners inside the solid. One on its surface counts if the cell's side of the
  /// surface is inside: `shift` [m] towards the cell's middle.
  std::vector<Vector3> corners_inside(const WindingNumber& winding, double shift) const;
};

struct Nearness {
  double flat;   ///< distance below which points lie in a plane that cuts [m]
  double shift;  ///< distance from the surface at which inside and outside are told apart [m]
};

/// Points of the two sides of a plane: [0] below, [1] above it.
using Sides = std::array<std::vector<Vector3>, 2>;

struct Part {
  std::vector<Corners3> triangles;  ///< surface of the solid within the cell
  std::vector<Vector3> corners;     ///< corners of the cell inside the solid
  Cell cell;
  std::vector<CutPlane> planes;  ///< planes that cut it, outward
  std::vector<int> reflex;       ///< indices of reflex edges within the cell

  /// Returns the points whose hulls are those of the two sides of the plane; every `stride`-th
  /// triangle counts. `hull`: of the part, outside of which nothing counts.
  Sides points_beside(const CutPlane& plane, const Nearness& near, std::size_t stride,
                      const WindingNumber& winding, const ConvexMesh& hull) const;
  /// Returns the two sides of the plane, without reflex edges.
  std::array<Part, 2> split(const CutPlane& plane, const Nearness& near,
                            const WindingNumber& winding, const ConvexMesh& hull) const;
  std::vector<Vector3> points() const;
};

}  // namespace counterpoint::pieces
