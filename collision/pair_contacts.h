// Contact points of two shapes: pure functions, one a pair of shape types.
#pragma once

#include <limits>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Fills `out` with the contact points of shapes A and B whose gap is below the margin [m]; poses in
/// any common frame. Points of overlapping, touching and separated shapes alike; the smallest gap is
/// the signed distance of the two shapes (penetration: least translation that separates them).
/// Exchanging A and B gives the same points in the same order with the normals turned round.
/// Two planes have no contact points, nor have a plane or a terrain and a terrain.
/// turn [rad]: how far the shapes may turn before contacts are looked for again. Of a hull on a plane
/// with more vertices within the margin than a manifold holds those are taken on which this may make it
/// stand.
void pair_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   double margin, Manifold& out,
                   double turn = std::numeric_limits<double>::infinity());

}  // namespace counterpoint::collision
