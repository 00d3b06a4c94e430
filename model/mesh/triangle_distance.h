// Distance of a point from a segment and from a triangle [m].
#pragma once

#include <algorithm>
#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

inline double distance_to_segment(const Vector3& p, const Vector3& a, const Vector3& b) {
  const Vector3 edge = b - a;
  const double length2 = edge.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * edge).norm();
}

/// A triangle without area counts as its edges.
inline double distance_to_triangle(const Vector3& p, const Vector3& a, const Vector3& b,
                                   const Vector3& c) {
  const Vector3 normal = (b - a).cross(c - a);
  const auto inside = [&](const Vector3& u, const Vector3& v) {
    return normal.dot((v - u).cross(p - u)) >= 0.0;
  };
  if (inside(a, b) && inside(b, c) && inside(c, a) && normal.squaredNorm() > 0.0) {
    return std::abs(normal.normalized().dot(p - a));
  }
  return std::min(
      {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

}  // namespace counterpoint
