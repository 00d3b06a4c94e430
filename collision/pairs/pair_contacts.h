// Contact points of two shapes: pure functions, one a pair of shape types.
#pragma once

#include <limits>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// What is asked of two shapes.
struct PairQuery {
  // Most callers give a margin only.
  PairQuery(double margin_value, double turn_value = std::numeric_limits<double>::infinity(),
            double rounding_value = 0.0)
      : margin(margin_value), turn(turn_value), rounding(rounding_value) {}

  double margin;  ///< contact points with a gap below this [m]
  /// How far the shapes may turn before contacts are looked for again [rad]. Of a hull on a plane
  /// with more vertices within the margin than a manifold holds those are taken on which this may
  /// make it stand.
  double turn;
  /// Edges of boxes count as rounded off by this [m]: where two touch in one line, every direction
  /// between the faces is a normal, and ways out that differ by less than this are averaged.
  double rounding;
};

/// Fills `out` with the contact points of shapes A and B whose gap is below the margin; poses in
/// any common frame. Points of overlapping, touching and separated shapes alike; the smallest gap
/// is the signed distance of the two shapes (penetration: least translation that separates them).
/// Exchanging A and B gives the same points in the same order with the normals turned round.
/// Two planes have no contact points, nor have a plane or a terrain and a terrain.
void pair_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   const PairQuery& query, Manifold& out);

}  // namespace counterpoint::collision
