// Points, segments and lines: closest points.
#pragma once

#include <algorithm>
#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {

/// The segment center + t direction, |t| <= half_length; direction has unit length.
struct Segment {
  Vector3 center, direction;
  double half_length;

  Vector3 at(double t) const { return center + t * direction; }
  /// Returns the parameter of the point closest to p.
  double closest(const Vector3& p) const {
    return std::clamp(direction.dot(p - center), -half_length, half_length);
  }
};

/// Finds the parameters (s, t) of the closest points of the lines through two segments; false if
/// the lines are parallel to round-off.
inline bool closest_on_lines(const Segment& a, const Segment& b, double& s, double& t) {
  const Vector3 cross = a.direction.cross(b.direction);
  const double sine2 = cross.squaredNorm();
  if (sine2 < 1e-20) return false;
  const Vector3 r = b.center - a.center;
  s = r.cross(b.direction).dot(cross) / sine2;
  t = r.cross(a.direction).dot(cross) / sine2;
  return true;
}

}  // namespace counterpoint::collision
