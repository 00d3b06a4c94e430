#include "counterpoint/model/joint.h"

#include <cmath>

namespace counterpoint {

const char* joint_type_name(JointType type) {
  switch (type) {
    case JointType::kRevolute:
      return "revolute";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kPlanar:
      return "planar";
    case JointType::kSpherical:
      return "spherical";
    case JointType::kFloating:
      return "floating";
  }
  return "?";
}

namespace {

Matrix3 rotation_about_z(double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  Matrix3 r;
  r << c, -s, 0, s, c, 0, 0, 0, 1;
  return r;
}

Matrix3 rotation_from_wxyz(const double* q) {
  return Quaternion(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

}  // namespace

Pose joint_pose(JointType type, const double* q) {
  switch (type) {
    case JointType::kRevolute:
      return {rotation_about_z(q[0]), Vector3::Zero()};
    case JointType::kPrismatic:
      return {Matrix3::Identity(), Vector3(0, 0, q[0])};
    case JointType::kPlanar:
      return {rotation_about_z(q[2]), Vector3(q[0], q[1], 0)};
    case JointType::kSpherical:
      return {rotation_from_wxyz(q), Vector3::Zero()};
    case JointType::kFloating:
      return {rotation_from_wxyz(q + 3), Vector3(q[0], q[1], q[2])};
  }
  return {};
}

}  // namespace counterpoint
