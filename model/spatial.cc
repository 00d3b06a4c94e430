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

Quaternion quaternion_exp(const Vector3& rotation_vector) {
  const double angle2 = rotation_vector.squaredNorm();
  // Series of sin(a/2)/a below 1e-4 rad: the next term is a^4/3840 < 1e-19.
  double s = 0.0;
  double c = 0.0;
  if (angle2 < 1e-8) {
    s = 0.5 - angle2 / 48.0;
    c = 1.0 - angle2 / 8.0;
  } else {
    const double angle = std::sqrt(angle2);
    s = std::sin(0.5 * angle) / angle;
    c = std::cos(0.5 * angle);
  }
  return {c, s * rotation_vector.x(), s * rotation_vector.y(), s * rotation_vector.z()};
}

}  // namespace counterpoint
