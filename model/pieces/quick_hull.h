// Hulls by which cuts and joins are weighed. Private to pieces.
#pragma once

#include <vector>

#include "counterpoint/model/pieces/part.h"
#include "counterpoint/model/pieces/work.h"

namespace counterpoint::pieces {

struct QuickHull {
  double volume = 0.0;          ///< [m^3]; 0 if the points span none
  std::vector<CutPlane> faces;  ///< outward; none without volume

  bool contains(const Vector3& p, double slack) const;
};

/// Returns the convex hull of points. If there are many, those count that are extreme in one of 128
/// directions, which turn with `axes`. Faster than make_convex_hull.
QuickHull quick_hull(const std::vector<Vector3>& points, const Matrix3& axes, Work& work);

}  // namespace counterpoint::pieces
