// Points spread evenly over the unit sphere: search directions, or the corners of a hull.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::test {

/// Returns a golden spiral of `count` unit vectors from near +z to near -z.
inline std::vector<Vector3> sphere_points(int count) {
  std::vector<Vector3> points;
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    points.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return points;
}

}  // namespace counterpoint::test
