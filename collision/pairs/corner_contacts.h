// Contacts of the far corners of two shapes that may turn into each other within a step.
#pragma once

#include <array>
#include <optional>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/collision/shapes/enclosure.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// The points of a shape that may turn into another one, in its geometry frame: of a box its
/// corners, of a capsule its ends, of a cylinder four points a rim, of a convex mesh the vertices
/// farthest along the eight diagonals; none of a sphere, a plane and terrain.
struct Corners {
  std::array<Vector3, 8> points;  // [m]
  int size = 0;
  double radius = 0.0;  // of the balls about them [m]
  double extent = 0.0;  // distance of the farthest corner from their mean, with its radius [m]
};
Corners corners_of(const Shape& shape);

/// A placed shape and its corners.
struct CorneredShape {
  const Shape& shape;
  const Corners& corners;
  const Pose& X;
};

/// Adds to `manifold`, which holds the contacts of two separated shapes, those of their corners,
/// each taken as a point (the ends of a capsule as balls) against the other shape, where the gap is
/// below the margin [m]. A manifold holds what faces each other now; a rod hit at one end turns the
/// other one in. Does nothing for planes, terrain and spheres, whose manifolds are whole, for
/// overlapping shapes, and for shapes larger than a few times `travel` [m], the way their surfaces
/// can go within the step.
void add_corner_contacts(const CorneredShape& a, const CorneredShape& b, double margin,
                         double travel, Manifold& manifold);

/// The ball about the middle of a slender or flat shape. Set against what the shape may pass within
/// a step it keeps the middle on its side, since the middle of a free body moves straight: corners
/// that turned into the other shape no longer hold the rest back. Nothing if the shape is compact,
/// or large against `travel` [m].
struct CoreBall {
  Shape shape;
  Pose X;
};
std::optional<CoreBall> core_ball(const Shape& shape, const Enclosure& enclosure, const Pose& X,
                                  double travel);

/// Every ball that stands for a shape in these contacts, at any size and travel: its corners
/// (radius 0; of a capsule its ends), then the one about its middle.
struct StandIns {
  std::array<CoreBall, 9> balls;
  int size = 0;
};
StandIns stand_ins(const Shape& shape, const Pose& X);

/// The contact of a core ball of A with B (its normal from A to B), if the gap is below the margin
/// [m] and the ball's middle has not passed the surface of B. No terrain.
void find_core_contact(const CoreBall& ball, const Shape& b, const Pose& X_WB, double margin,
                       Manifold& out);

}  // namespace counterpoint::collision
