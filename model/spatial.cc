#include "counterpoint/model/spatial.h"

namespace counterpoint {

SpatialInertia SpatialInertia::operator+(const SpatialInertia& o) const {
  const double total = mass + o.mass;
  if (total == 0.0) return {0.0, center, rotational + o.rotational};
  const Vector3 c = (mass * center + o.mass * o.center) / total;
  // Parallel axis theorem in terms of the distance of the two centres: no cancellation when they
  // coincide.
  const Matrix3 s = skew(o.center - center);
  return {total, c, rotational + o.rotational - (mass * o.mass / total) * s * s};
}

Matrix6 SpatialInertia::matrix() const {
  const Matrix3 s = skew(center);
  Matrix6 m;
  m.topLeftCorner<3, 3>() = rotational - mass * s * s;
  m.topRightCorner<3, 3>() = mass * s;
  m.bottomLeftCorner<3, 3>() = -mass * s;
  m.bottomRightCorner<3, 3>() = mass * Matrix3::Identity();
  return m;
}

}  // namespace counterpoint
