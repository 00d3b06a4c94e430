// Joint types: the coordinates (q, v) and the relative pose and velocity that they give.
//
// The axis of every joint is the z axis of its joint frame J, which is fixed to the parent: the
// builder turns body frames accordingly, so that inner loops need only one revolute and one
// prismatic joint.
//
//   type        nq nv  q                       v
//   kRevolute    1  1  angle [rad]             rate about z [rad/s]
//   kPrismatic   1  1  displacement [m]        rate along z [m/s]
//   kPlanar      3  3  x, y [m], angle [rad]   rates, x and y along the axes of J [m/s, rad/s]
//   kSpherical   4  3  qw qx qy qz             angular velocity in body axes [rad/s]
//   kFloating    7  6  x y z [m] qw qx qy qz   linear in J [m/s], angular in body axes [rad/s]
//
// Linear velocities of planar and floating joints are expressed in the axes of J, so that a free
// body whose origin is its centre of mass moves on a straight line in discrete time too.
#pragma once

#include <cmath>
#include <span>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

enum class JointType : unsigned char { kRevolute, kPrismatic, kPlanar, kSpherical, kFloating };

constexpr int joint_nq(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      return 1;
    case JointType::kPlanar:
      return 3;
    case JointType::kSpherical:
      return 4;
    case JointType::kFloating:
      return 7;
  }
  return 0;
}

constexpr int joint_nv(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      return 1;
    case JointType::kPlanar:
    case JointType::kSpherical:
      return 3;
    case JointType::kFloating:
      return 6;
  }
  return 0;
}

/// Number of a joint's linear velocity coordinates; they come first, then the angular ones.
constexpr int joint_num_linear(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kSpherical:
      return 0;
    case JointType::kPrismatic:
      return 1;
    case JointType::kPlanar:
      return 2;
    case JointType::kFloating:
      return 3;
  }
  return 0;
}

/// Returns the rotation R followed by a rotation of `angle` [rad] about its own z axis.
Matrix3 turned_about_z(const Matrix3& R, double angle);

/// Returns the pose X_WB of a body from the pose X_WJ of its joint frame and the joint's
/// coordinates q (joint_nq numbers as in the table above; quaternions of unit length).
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

/// Returns "revolute", "prismatic", "planar", "spherical" or "floating".
const char* joint_type_name(JointType type);

/// Ends of the names of a joint's columns in tables, in the order of its q (joint_nq), v and force
/// (joint_nv): "q", "v", "u" for one coordinate, else "x", "vx", "fx" ...
struct JointSuffixes {
  std::span<const char*const> q, v, force;
};
JointSuffixes joint_suffixes(JointType type);

}  // namespace counterpoint
