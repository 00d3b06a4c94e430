// Contacts of corners that may turn into another shape within a step.
#pragma once

#include <array>
#include <optional>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/collision/shapes/enclosure.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// The points of a shape that may turn into another one, in its geometry frame: the corners of a
/// box, the ends of a capsule, four points per rim of a cylinder, the vertices of a convex mesh
/// farthest along the eight diagonals; none for spheres, planes and terrain.
struct Corners {
  std::array<Vector3, 8> points;  // [m]
  int size = 0;
  double radius = 0.0;  // radius of the balls around the points [m]
  double extent = 0.0;  // largest distance of a corner from their mean, plus the radius [m]
};
Corners corners_of(const Shape& shape);

/// A placed shape and its corners.
struct CorneredShape {
  const Shape& shape;
  const Corners& corners;
  const Pose& X;
};

/// Adds to `manifold`, which holds the contacts of two separated shapes, the contacts of their
/// corners with the other shape where the gap is below the margin [m]; a corner is a point, the end
/// of a capsule a ball. The manifold has only features that face each other now, but a rod hit at
/// one end turns its other end in. Does nothing for planes and terrain, whose manifolds are
/// complete, for spheres, for overlapping shapes, and for shapes larger than a few times `travel`
/// [m], the distance that their surfaces can move within the step.
void add_corner_contacts(const CorneredShape& a, const CorneredShape& b, double margin,
                         double travel, Manifold& manifold);

/// A ball around the middle of a slender or flat shape. Its contact keeps the middle, which on a
/// free body moves straight, from passing another shape within a step: corners that have turned
/// into that shape do not hold it back. Nothing if the shape is compact, or large compared to
/// `travel` [m].
struct CoreBall {
  Shape shape;
  Pose X;
};
std::optional<CoreBall> core_ball(const Shape& shape, const Enclosure& enclosure, const Pose& X,
                                  double travel);

/// All balls used for a shape in these contacts, whatever its size and travel: its corners (radius
/// 0, except for the ends of a capsule), then the core ball.
struct StandIns {
  std::array<CoreBall, 9> balls;
  int size = 0;
};
StandIns stand_ins(const Shape& shape, const Pose& X);

/// Finds the contact of a core ball of A with B, not a terrain (normal from A to B), if the gap is
/// below the margin [m] and the ball's centre has not passed the surface of B.
void find_core_contact(const CoreBall& ball, const Shape& b, const Pose& X_WB, double margin,
                       Manifold& out);

}  // namespace counterpoint::collision
