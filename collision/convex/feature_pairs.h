// The exact normal between a feature (corner, edge, side or rim) of one shape and a feature of
// another.
//
// Iteration on support functions converges slowly on a curved surface. Once the touching features
// are known, their common normal solves a smooth problem with at most two unknowns. Private to gjk
// and epa.
#pragma once

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/convex/minkowski.h"

namespace counterpoint::collision {

/// A smooth part of the surface of a core: a corner, an edge or side, a rim, or a face.
struct Piece {
  enum Kind : unsigned char { kPoint, kLine, kRim, kFace } kind = kPoint;
  Vector3 center = Vector3::Zero();  ///< the point, a point of the face, or centre of line or rim
  Vector3 axis = Vector3::UnitZ();   ///< unit: along the line, rim's axis, or face's normal
  double size = 0.0;                 ///< half length of the line, or radius of the rim [m]
  double radius = 0.0;               ///< radius of the cylinder whose side the line is, else 0 [m]
};

/// Finds the closest points of two cores, or for overlapping cores the points of (locally) least
/// penetration, from at most three nearby points of their Minkowski difference and the normal that
/// these suggest (from A to B). True only if the answer is certain: to 1e-13 of the size, the
/// points have the distance of the cores along the normal, and it is at least `least` [m].
bool settle_on_feature_pair(const MinkowskiDifference& difference, const DifferencePoint* points,
                            int num_points, const Vector3& normal, double least, Witness& out);

}  // namespace counterpoint::collision
