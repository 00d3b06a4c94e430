// Independent references for tests of shape pairs: membership, support function and least
// translation, written as plainly as possible.
#pragma once

#include <vector>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::test {

using collision::ContactPoint;
using collision::Manifold;

Shape plane_shape();
Shape sphere_shape(double radius);
Shape box_shape(const Vector3& half);
Shape capsule_shape(double radius, double half_length);
Shape cylinder_shape(double radius, double half_length);
/// A prism over a regular polygon with `corners` corners at `radius`, along z from -half to half.
/// The top polygon is scaled by `taper` (a frustum).
Shape prism_shape(int corners, double radius, double half, double taper = 1.0);
/// The convex hull of points that span a volume.
Shape hull_shape(const std::vector<Vector3>& points);

/// Negative inside, zero on the surface, positive outside; a distance [m] only near the surface.
double level(const Shape& shape, const Pose& X, const Vector3& point);

/// Support function: the largest direction . x over points x of the shape [m].
double support_height(const Shape& shape, const Pose& X, const Vector3& direction);

/// Returns the distance of A and B along the unit vector n [m]. For every n it is a lower bound of
/// the distance of separated shapes, and its negative an upper bound of the penetration depth of
/// overlapping ones.
double distance_along(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B,
                      const Vector3& n);

/// Returns directions that include every face normal of the Minkowski difference of two polytopes
/// (boxes, prisms, segments of capsules): face normals and cross products of edges. Unit vectors of
/// both signs.
std::vector<Vector3> candidate_normals(const Shape& a, const Pose& X_A, const Shape& b,
                                       const Pose& X_B);

/// Returns the largest distance_along found [m]: over candidate_normals, which suffice for
/// polytopes; for smooth shapes also over a net of directions refined by local search. The signed
/// distance of overlapping shapes is never below it.
double largest_distance_along(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B);

/// Returns the contact with the least gap; size must be above 0.
const ContactPoint& deepest(const Manifold& manifold);

}  // namespace counterpoint::test
