// Areas that the contact points of a pair stand for, for surfaces with a stiffness per area.
//
// The surfaces press on each other with k_A V, V the volume of their overlap along the contact
// normal (Winkler's foundation). V is found from the two features that face each other (feature.h):
//
//   faces            the integral of the depth over the part of their common polygon that overlaps
//   ball, radius R   pi R d^2
//   cylinder, length L, on its side   4/3 L d sqrt(2 R d)
//   corner           pi d^3 / 3, a cone of 45 degrees
//
// and is shared among the points so that the areas w_i satisfy sum w_i d_i = V: the total does not
// depend on their number. If the whole polygon overlaps, sum w_i is its area and sum w_i x_i / sum
// w_i its centroid; else the points have the weights of their convex hull.
//
// A patch that grows within the step has the area that it reaches at its present velocity:
// otherwise a face that closes its gap would meet no spring.
#pragma once

#include <span>

#include "counterpoint/collision/manifold.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Two shapes and the displacement of B relative to A within the step, at the origin of the poses'
/// frame [rad, m].
struct PatchPair {
  const Shape& a;
  const Pose& X_WA;
  const Shape& b;
  const Pose& X_WB;
  Motion displacement;
};

/// Sets the area of each contact point [m^2], 0 for one that neither touches nor will within the
/// step. Contacts of one normal share a patch; terrain counts as the tangent plane at the deepest
/// of them, with the share of the pair's points that have this normal. Two bodies without a face
/// meet as two balls.
/// @param area  as many as points, at most Manifold::kCapacity
void patch_areas(const PatchPair& pair, std::span<const ContactPoint> points,
                 std::span<double> area);

}  // namespace counterpoint::collision
