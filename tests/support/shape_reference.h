// Independent references for the tests of pairs: membership, support and least translation, each
// written as plainly as can be.
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
/// A prism over a regular polygon: `corners` of them at `radius`, along z from -half to half, the
/// top polygon scaled by `taper` (a frustum).
Shape prism_shape(int corners, double radius, double half, double taper = 1.0);
/// The convex hull of points that span a volume.
Shape hull_shape(const std::vector<Vector3>& points);

/// Negative inside, zero on the surface, positive outside; a distance near the surface only [m].
double level(const Shape& shape, const Pose& X, const Vector3& point);

/// max over the shape of direction . x [m].
double support_height(const Shape& shape, const Pose& X, const Vector3& direction);

/// Distance of A and B along the unit vector n: a lower bound of the distance of separated shapes,
/// and its negative an upper bound of the penetration depth of overlapping ones, for every n.
double distance_along(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B,
                      const Vector3& n);

/// Directions that hold every face normal of the Minkowski difference of two polytopes (boxes,
/// prisms, segments of capsules): face normals and cross products of edges. Unit, both signs.
std::vector<Vector3> candidate_normals(const Shape& a, const Pose& X_A, const Shape& b,
                                       const Pose& X_B);

/// The largest distance_along found: over candidate_normals, which for polytopes is all that can
/// matter, else also over a net of directions refined by local search. The signed distance of
/// overlapping shapes is never below it.
double largest_distance_along(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B);

/// The contact of least gap; size > 0.
const ContactPoint& deepest(const Manifold& manifold);

}  // namespace counterpoint::test
