// Signed distance of two polytopes, swept by balls, over all features: no iteration, no cleverness.
#pragma once

#include "support/shape_reference.h"

namespace counterpoint::test {

/// True for shapes whose core is a point, a segment or a polytope: all but planes and cylinders.
bool has_polytope_core(const Shape& shape);

/// Signed distance [m] of two shapes with polytope cores: the least over all pairs of corners,
/// edges and faces, or, if no such pair shows the cores apart, minus the least translation along
/// any normal of their Minkowski difference. Costs edges times edges times corners.
double brute_force_distance(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B);

}  // namespace counterpoint::test
