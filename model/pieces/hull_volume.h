// Volumes of hulls by which cuts and joins are weighed. Private to pieces.
#pragma once

#include <vector>

#include "counterpoint/model/pieces/work.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::pieces {

/// Returns the volume of the convex hull of points [m^3]; 0 if they span none. If there are many,
/// those count that are extreme in one of 128 directions, which turn with `axes`. Faster than
/// convex_hull_volume.
double hull_volume(const std::vector<Vector3>& points, const Matrix3& axes, Work& work);

}  // namespace counterpoint::pieces
