// Rotations: unit quaternions and matrices, exponential map, axis alignment.
#pragma once

#include <cmath>

#include "counterpoint/model/types.h"

namespace counterpoint {

/// The matrix of the cross product: skew(a) * b = a x b.
inline Matrix3 skew(const Vector3& a) {
  Matrix3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Rotation matrix of URDF's fixed-axis roll, pitch, yaw [rad]: Rz(yaw) Ry(pitch) Rx(roll).
Matrix3 rotation_from_rpy(double roll, double pitch, double yaw);

/// Unit quaternion of a rotation vector [rad] (axis times angle), exact to round-off at every angle.
inline Quaternion quaternion_exp(const Vector3& rotation_vector) {
  const double angle2 = rotation_vector.squaredNorm();
  // sin(a/2)/a by series below 1e-4 rad: the next term is a^4/3840 < 1e-19.
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

/// Rotation vector [rad], angle in [0, pi], of a unit quaternion: the inverse of quaternion_exp.
Vector3 quaternion_log(const Quaternion& q);

/// A rotation that takes the z axis to the unit vector `axis`; the identity when axis is z itself,
/// free of round-off when axis is a coordinate axis.
Matrix3 rotation_z_to(const Vector3& axis);

/// A right-handed frame (t1, t2, n), as columns, whose third axis is the unit vector n.
/// A pure function of n, continuous but at n = -z (Duff et al. 2017, "Building an orthonormal basis,
/// revisited").
inline Matrix3 frame_from_normal(const Vector3& n) {
  const double sign = std::copysign(1.0, n.z());
  const double a = -1.0 / (sign + n.z());
  const double b = n.x() * n.y() * a;
  Matrix3 frame;
  frame.col(0) << 1.0 + sign * n.x() * n.x() * a, sign * b, -sign * n.x();
  frame.col(1) << b, sign + n.y() * n.y() * a, -n.y();
  frame.col(2) = n;
  return frame;
}

}  // namespace counterpoint
