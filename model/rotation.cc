#include "counterpoint/model/spatial.h"

namespace counterpoint {

Matrix3 rotation_from_rpy(double roll, double pitch, double yaw) {
  return (Eigen::AngleAxisd(yaw, Vector3::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3::UnitY()) *
          Eigen::AngleAxisd(roll, Vector3::UnitX()))
      .toRotationMatrix();
}

Vector3 quaternion_log(const Quaternion& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();
  // angle / sin(angle/2) -> 2 / cos(angle/2) for small angles.
  const double scale =
      sine < 1e-8 ? 2.0 / (sign * q.w()) : 2.0 * std::atan2(sine, sign * q.w()) / sine;
  return sign * scale * q.vec();
}

Matrix3 rotation_z_to(const Vector3& axis) {
  // Shortest rotation from z to the axis in closed form, exact for the coordinate axes. Axes with z
  // < 0 start from -z, far from the pole of 1 / (1 + z).
  const double sign = std::copysign(1.0, axis.z());
  const Vector3 a = sign * axis;
  const double s = 1.0 / (1.0 + a.z());
  Matrix3 r;
  r << 1.0 - a.x() * a.x() * s, -a.x() * a.y() * s, a.x(),  //
      -a.x() * a.y() * s, 1.0 - a.y() * a.y() * s, a.y(),   //
      -a.x(), -a.y(), a.z();
  r.rightCols<2>() *= sign;
  return r;
}

}  // namespace counterpoint
