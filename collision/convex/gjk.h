// Closest or deepest points of two convex shapes by iteration on their support functions.
//
// Separated cores: Gilbert, Johnson, Keerthi 1988, with exact subsimplices. Overlapping cores: the
// expanding polytope algorithm, van den Bergen 2001. libccd is not used because it allocates in
// every call and stops at a relative error of 1e-6.
#pragma once

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint::collision {

/// Finds the closest points of the cores of A and B (any shapes but planes), or for overlapping
/// cores the points of least penetration. False if the gap of the shapes is at least `margin` [m].
bool closest_points(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    double margin, Witness& out);

}  // namespace counterpoint::collision
