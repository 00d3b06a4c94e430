// Joint types and how each turns (q, v) into a relative pose and velocity.
//
// Every joint's axis is the z axis of its joint frame J: the builder turns body frames so that this
// holds, and hot loops then know one revolute and one prismatic joint only.
//
//   type        nq nv  q                       v
//   kRevolute    1  1  angle [rad]             rate [rad/s], about z
//   kPrismatic   1  1  displacement [m]        rate [m/s], along z
//   kPlanar      3  3  x, y [m], angle [rad]   rates, x and y in the axes of J (not turning with the body)
//   kSpherical   4  3  qw qx qy qz             angular velocity [rad/s], in the axes of the body
//   kFloating    7  6  x y z [m] qw qx qy qz   linear [m/s] in the axes of J, angular [rad/s] in the axes of the body
//
// Velocities of planar and floating joints are kept in the parent's axes so that a free body's centre
// flies straight in discrete time as well.
#pragma once

#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

enum class JointType : unsigned char { kRevolute, kPrismatic, kPlanar, kSpherical, kFloating };

constexpr int joint_nq(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic: return 1;
    case JointType::kPlanar: return 3;
    case JointType::kSpherical: return 4;
    case JointType::kFloating: return 7;
  }
  return 0;
}

constexpr int joint_nv(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic: return 1;
    case JointType::kPlanar:
    case JointType::kSpherical: return 3;
    case JointType::kFloating: return 6;
  }
  return 0;
}

/// How many of a joint's velocities are along axes; they come first, then those about axes.
constexpr int joint_num_linear(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kSpherical: return 0;
    case JointType::kPrismatic: return 1;
    case JointType::kPlanar: return 2;
    case JointType::kFloating: return 3;
  }
  return 0;
}

/// Turns frame J about its z axis.
inline Matrix3 turned_about_z(const Matrix3& R, double angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  Matrix3 out;
  out.col(0) = c * R.col(0) + s * R.col(1);
  out.col(1) = c * R.col(1) - s * R.col(0);
  out.col(2) = R.col(2);
  return out;
}

/// Pose X_WB of a body from that of its joint frame, X_WJ, and the joint's coordinates q [rad, m,
/// quaternion of unit length] as above, joint_nq long.
inline Pose joint_pose(const Pose& X_WJ, JointType type, const double* q) {
  const Matrix3& R = X_WJ.rotation;
  switch (type) {
    case JointType::kRevolute:
      return {turned_about_z(R, q[0]), X_WJ.translation};
    case JointType::kPrismatic:
      return {R, X_WJ.translation + q[0] * R.col(2)};
    case JointType::kPlanar:
      return {turned_about_z(R, q[2]), X_WJ.translation + q[0] * R.col(0) + q[1] * R.col(1)};
    case JointType::kSpherical:
      return {R * Quaternion(q[0], q[1], q[2], q[3]).toRotationMatrix(), X_WJ.translation};
    case JointType::kFloating:
      return {R * Quaternion(q[3], q[4], q[5], q[6]).toRotationMatrix(),
              X_WJ * Vector3(q[0], q[1], q[2])};
  }
  return X_WJ;
}

/// "revolute", "prismatic", "planar", "spherical", "floating".
const char* joint_type_name(JointType type);

}  // namespace counterpoint
