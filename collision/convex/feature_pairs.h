// The exact normal between a feature (corner, edge, side or rim) of one shape and a feature of
// another.
//
// Iteration on support functions converges slowly on a curved surface. Once it is known which
// features touch, their common normal is a smooth problem in at most two unknowns. Private to gjk
// and epa.
#pragma once

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/convex/minkowski.h"

namespace counterpoint::collision {

/// A part of the surface of a core that is smooth as seen along its normals.
struct Piece {
  enum Kind : unsigned char { kPoint, kLine, kRim, kFace } kind = kPoint;
  Vector3 center = Vector3::Zero();  ///< the point; the middle of the line; the centre of the rim;
                                     ///< a point of the face
  Vector3 axis = Vector3::UnitZ();   ///< along the line, or of the rim, or the face's normal; unit
  double size = 0.0;                 ///< half length of the line, or radius of the rim [m]
  double radius = 0.0;  ///< of the tube around a line that is the side of a cylinder [m]
};

/// Finds the closest points of two cores, or those parted by the least translation (locally), from
/// points of their difference that are near: at most three, and the normal they suggest (from A to
/// B). True only if the answer is certain: to 1e-13 of the size, the distance along the normal is
/// that of the points, and it is at least `least` [m].
bool settle_on_feature_pair(const MinkowskiDifference& difference, const DifferencePoint* points,
                            int num_points, const Vector3& normal, double least, Witness& out);

}  // namespace counterpoint::collision
