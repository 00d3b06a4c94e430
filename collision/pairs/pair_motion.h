// Contacts of a pair of shapes as its motion within the step makes them.
#pragma once

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Where a shape is and where its body's velocity takes it within the step.
struct ShapeMotion {
  Pose X_WG;
  Vector3 origin;       ///< of the body, in W [m]
  Motion displacement;  ///< about that origin, in W [rad; m]
  double share;         ///< of what the two move against each other this one makes; 0 ... 1

  /// Where the body's point at p goes [m].
  Vector3 way_of(const Vector3& p) const { return displacement.at(p - origin); }
  Pose moved() const;
};

/// The motion of two shapes within a step.
struct PairMotion {
  PairMotion(const ShapeMotion& motion_a, const ShapeMotion& motion_b, const Vector3& middle,
             double radius);

  ShapeMotion a, b;
  double size;  ///< radius of the smaller shape [m]
  double way;   ///< how far a point of that one goes against the other shape, at most [m]

  /// How far the edges of shapes that rest against each other count as rounded off [m]; less if
  /// they move, until there is none left.
  double rounding() const;

  /// By how much a gap at p along n shrinks [m].
  double closing(const Vector3& n, const Vector3& p) const;
  /// A contact that the shapes have after the motion, with gap and place taken back to the start.
  ContactPoint taken_back(const ContactPoint& after) const;
};

/// Replaces the contacts of two convex shapes, if they would stop the motion, by those that the
/// shapes have after it, where these part the shapes now as well; gaps and places are taken back to
/// the start, so that they make the same kind of linear constraint. Any direction that parts two
/// shapes now and after the step is as good a normal as that of their least distance. That one
/// stops a box which slides over the seam between two others of one height, and what passes a
/// corner closely. Does nothing where the way is a good part of the size: what turns far may pass
/// through another though one direction parts them before and after.
void look_ahead(const Shape& a, const Shape& b, const PairMotion& motion, const PairQuery& query,
                Manifold& manifold);

}  // namespace counterpoint::collision
