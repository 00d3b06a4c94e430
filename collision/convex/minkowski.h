// The Minkowski difference B - A of two cores, by its support function. Private to gjk and epa.
#pragma once

#include <array>

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/shapes/core_shape.h"

namespace counterpoint::collision {

/// A point w = b - a of the difference.
struct DifferencePoint {
  Vector3 w, a, b;
};

struct MinkowskiDifference {
  const CoreShape& a;
  const CoreShape& b;
  double scale;   ///< size of the shapes [m], to scale tolerances
  Vector3 shift;  ///< translation of B [m]

  DifferencePoint support(const Vector3& direction) const {
    DifferencePoint p;
    p.a = a.support(-direction);
    p.b = b.support(direction) + shift;
    p.w = p.b - p.a;
    return p;
  }
  /// True if a part of the surface is curved, where support iteration converges slowly.
  bool curved() const {
    return a.shape.type == ShapeType::kCylinder || b.shape.type == ShapeType::kCylinder;
  }
  /// Distance of the cores along the unit vector n [m]: a lower bound of their signed distance.
  double distance_along(const Vector3& n) const { return n.dot(support(-n).w); }
};

struct Simplex {
  std::array<DifferencePoint, 4> points;
  std::array<double, 4> weights;  ///< barycentric coordinates of the point closest to the origin
  double weight_sum = 1.0;        ///< divides the weights
  int size = 0;
};

/// Grows a polytope inside the difference, from a simplex that contains the origin (or comes within
/// round-off of it), until the face nearest the origin belongs to the difference, or the pieces of
/// the cores that touch there are found. True if `out` is the answer. If false, only out.normal
/// (from A to B, off by about 1e-3 rad) and out.distance along it are set.
bool expand_polytope(const MinkowskiDifference& difference, const Simplex& start, Witness& out);

}  // namespace counterpoint::collision
