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

/// Pose of the moved body in the joint frame J: q [rad, m, quaternion w x y z] as above, joint_nq long;
/// quaternions are normalised.
Pose joint_pose(JointType type, const double* q);

/// "revolute", "prismatic", "planar", "spherical", "floating".
const char* joint_type_name(JointType type);

}  // namespace counterpoint
