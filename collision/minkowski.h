// The Minkowski difference B - A of two cores, point by point. Private to gjk and epa.
#pragma once

#include <array>

#include "counterpoint/collision/core_shape.h"

namespace counterpoint::collision {

/// A point w = b - a of the difference.
struct DifferencePoint {
  Vector3 w, a, b;
};

struct MinkowskiDifference {
  const CoreShape& a;
  const CoreShape& b;
  double scale;  ///< size of the shapes [m], for tolerances

  DifferencePoint support(const Vector3& direction) const {
    DifferencePoint p;
    p.a = a.support(-direction);
    p.b = b.support(direction);
    p.w = p.b - p.a;
    return p;
  }
};

struct Simplex {
  std::array<DifferencePoint, 4> points;
  std::array<double, 4> weights;  ///< barycentric coordinates of the point closest to the origin
  int size = 0;
};

struct Witness;
/// Grows a polytope inside the difference, from a simplex that holds the origin (or comes within
/// round-off of it), until the face nearest the origin is one of the difference. Fills the witness:
/// core points, normal from A to B, signed distance.
void expand_polytope(const MinkowskiDifference& difference, const Simplex& start, Witness& out);

}  // namespace counterpoint::collision
