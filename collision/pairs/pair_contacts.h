// Contact points of two shapes: one pure function per pair of shape types.
#pragma once

#include <limits>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// The parameters of a contact search between two shapes.
struct PairQuery {
  // Not explicit: most callers give only a margin.
  PairQuery(double margin_value, double turn_value = std::numeric_limits<double>::infinity(),
            double rounding_value = 0.0)
      : margin(margin_value), turn(turn_value), rounding(rounding_value) {}

  double margin;  ///< upper bound of the gaps of contact points [m]
  /// How far the shapes may rotate before the next search [rad]. If a hull on a plane has more
  /// vertices within the margin than a manifold holds, those are kept on which it may stand after
  /// such a rotation.
  double turn;
  /// Radius [m] by which edges of boxes count as rounded: if two edges touch along a line, every
  /// direction between their faces is a normal, and normals whose separations differ by less are
  /// averaged.
  double rounding;
};

/// Fills `out` with the contact points of shapes A and B whose gap is below the margin; poses in
/// any common frame. Works for overlapping, touching and separated shapes; the smallest gap is the
/// signed distance of the shapes (in overlap: minus the length of the least translation that
/// separates them). Exchanging A and B gives the same points in the same order with opposite
/// normals. Two planes, two terrains, or a plane and a terrain have no contact points.
void pair_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   const PairQuery& query, Manifold& out);

}  // namespace counterpoint::collision
