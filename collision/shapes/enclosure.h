// What encloses a shape, and what it encloses, in its geometry frame. Computed once a shape.
#pragma once

#include "counterpoint/collision/broadphase/broadphase.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

struct Enclosure {
  Vector3 center = Vector3::Zero();
  Vector3 half = Vector3::Zero();  ///< of the box around it [m]
  double radius = 0.0;             ///< of the ball around it, about the centre [m]
  double thickness =
      0.0;  ///< distance of its surface from a point well inside, or a lower bound [m]
};

/// All zero for a plane.
Enclosure enclose(const Shape& shape);

/// The world-aligned box around a placed shape, `margin` [m] added: tight for round shapes, else
/// around its own box or ball, whichever is smaller.
Bounds bounds(ShapeType type, const Enclosure& enclosure, const Pose& X, double margin);

/// A lower bound of the distance of two placed shapes [m], round-off taken off: the widest gap of
/// their boxes and balls along the line of their centres and the axes of both boxes; 0 or less
/// where none parts them.
double separation(const Enclosure& a, const Pose& X_WA, const Enclosure& b, const Pose& X_WB);
/// The same above a plane (the half-space z <= 0 of its frame).
double height_above(const Pose& X_WP, const Enclosure& b, const Pose& X_WB);

}  // namespace counterpoint::collision
