// Bounding volumes of a shape and its half thickness, in its geometry frame. Computed once per
// shape.
#pragma once

#include "counterpoint/collision/broadphase/broadphase.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

struct Enclosure {
  Vector3 center = Vector3::Zero();
  Vector3 half = Vector3::Zero();  ///< half widths of the bounding box [m]
  double radius = 0.0;             ///< radius of the bounding ball about the centre [m]
  double thickness =
      0.0;  ///< distance of the surface from a point well inside, or a lower bound of it [m]
};

/// Returns the bounding volumes of a shape; all zero for a plane.
Enclosure enclose(const Shape& shape);

/// Returns the world-aligned bounding box of a placed shape, enlarged by `margin` [m]: tight for
/// round shapes, else around the shape's own box or ball, whichever is smaller.
Bounds bounds(ShapeType type, const Enclosure& enclosure, const Pose& X, double margin);

/// Returns a lower bound of the distance of two placed shapes [m], with round-off subtracted: the
/// widest gap of their boxes and balls along the line of their centres and the axes of both boxes.
/// 0 or less if none of these separates them.
double separation(const Enclosure& a, const Pose& X_WA, const Enclosure& b, const Pose& X_WB);
/// Returns a lower bound of the height above a plane (the half-space z <= 0 of its frame) [m].
double height_above(const Pose& X_WP, const Enclosure& b, const Pose& X_WB);

}  // namespace counterpoint::collision
