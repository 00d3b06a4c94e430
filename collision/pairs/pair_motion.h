// Contacts of a pair of shapes with regard to its motion within the step.
#pragma once

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Pose of a shape, and its displacement at its body's velocity within the step.
struct ShapeMotion {
  Pose X_WG;
  Vector3 origin;       ///< origin of the body, in W [m]
  Motion displacement;  ///< displacement of the body about `origin`, in W [rad; m]
  double share;         ///< share of this shape in the relative motion of the two, 0 ... 1

  /// Displacement of the body's point at p [m].
  Vector3 way_of(const Vector3& p) const { return displacement.at(p - origin); }
  Pose moved() const;
};

/// Motion of two shapes within a step.
struct PairMotion {
  PairMotion(const ShapeMotion& motion_a, const ShapeMotion& motion_b, const Vector3& middle,
             double radius);

  ShapeMotion a, b;
  double size;  ///< radius of the smaller shape [m]
  double way;   ///< bound on the displacement of its points relative to the other shape [m]

  /// Radius by which edges of shapes that rest against each other count as rounded [m]; it
  /// decreases with the motion, down to 0.
  double rounding() const;

  /// Decrease of a gap at p along n [m].
  double closing(const Vector3& n, const Vector3& p) const;
  /// Takes a contact of the shapes after the motion back: its gap and position are those at the
  /// start.
  ContactPoint taken_back(const ContactPoint& after) const;
};

/// Returns whether the contacts of two convex shapes would stop their motion. False if the
/// displacement is a good part of the size: a shape that turns far may pass through another
/// although one direction separates them before and after.
bool stops(const PairMotion& motion, const Manifold& manifold);

/// Replaces contacts that would stop the motion of two convex shapes by the contacts after the
/// motion, provided that these separate the shapes now as well. Gaps and positions are
/// taken back to the start, so that they give the same kind of linear constraint. Any direction
/// that separates two shapes before and after the step is as good a normal as that of least
/// distance; the latter would stop a box that slides over the seam between two others of equal
/// height, or a shape that passes close to a corner.
void look_ahead(const Shape& a, const Shape& b, const PairMotion& motion, const PairQuery& query,
                Manifold& manifold);

}  // namespace counterpoint::collision
