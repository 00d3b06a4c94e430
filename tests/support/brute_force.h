// Signed distance of two sphere-swept polytopes by enumeration of all features, without iteration.
#pragma once

#include "support/shape_reference.h"

namespace counterpoint::test {

/// True for shapes whose core is a point, a segment or a polytope: all but planes and cylinders.
bool has_polytope_core(const Shape& shape);

/// Returns the signed distance [m] of two shapes with polytope cores: the least over all pairs of
/// corners, edges and faces, or, if no such pair separates the cores, minus the least translation
/// along any normal of their Minkowski difference. Costs edges times edges times corners.
double brute_force_distance(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B);

}  // namespace counterpoint::test
