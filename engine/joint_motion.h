// What each joint type does, by switch: pose across the joint, motion subspace, and products with
// it. Conventions of q and v: model/joint.h.
#pragma once

#include <cmath>

#include "counterpoint/model/joint.h"

namespace counterpoint {

/// Turns frame J about its z axis.
inline Matrix3 turned_about_z(const Matrix3& R, double angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  Matrix3 out;
  out.col(0) = c * R.col(0) + s * R.col(1);
  out.col(1) = c * R.col(1) - s * R.col(0);
  out.col(2) = R.col(2);
  return out;
}

/// Pose X_WB of a body from that of its joint frame, X_WJ, and the joint's coordinates q.
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

/// Columns of S in world axes at the body's origin, into axis[0 .. nv).
inline void joint_axes(JointType type, const Matrix3& R_WJ, const Matrix3& R_WB, Motion* axis) {
  const Vector3 zero = Vector3::Zero();
  switch (type) {
    case JointType::kRevolute:
      axis[0] = {R_WJ.col(2), zero};
      return;
    case JointType::kPrismatic:
      axis[0] = {zero, R_WJ.col(2)};
      return;
    case JointType::kPlanar:
      axis[0] = {zero, R_WJ.col(0)};
      axis[1] = {zero, R_WJ.col(1)};
      axis[2] = {R_WJ.col(2), zero};
      return;
    case JointType::kSpherical:
      for (int j = 0; j < 3; ++j) axis[j] = {R_WB.col(j), zero};
      return;
    case JointType::kFloating:
      for (int j = 0; j < 3; ++j) axis[j] = {zero, R_WJ.col(j)};
      for (int j = 0; j < 3; ++j) axis[3 + j] = {R_WB.col(j), zero};
      return;
  }
}

/// S a: the motion across the joint for rates a.
inline Motion joint_motion(JointType type, const Motion* axis, const double* a) {
  switch (type) {
    case JointType::kRevolute:
      return {axis[0].angular * a[0], Vector3::Zero()};
    case JointType::kPrismatic:
      return {Vector3::Zero(), axis[0].linear * a[0]};
    case JointType::kPlanar:
      return {axis[2].angular * a[2], axis[0].linear * a[0] + axis[1].linear * a[1]};
    case JointType::kSpherical:
      return {axis[0].angular * a[0] + axis[1].angular * a[1] + axis[2].angular * a[2],
              Vector3::Zero()};
    case JointType::kFloating:
      return {axis[3].angular * a[3] + axis[4].angular * a[4] + axis[5].angular * a[5],
              axis[0].linear * a[0] + axis[1].linear * a[1] + axis[2].linear * a[2]};
  }
  return {};
}

/// tau += S' f: the force along the joint's coordinates.
inline void add_joint_force(JointType type, const Motion* axis, const Force& f, double* tau) {
  switch (type) {
    case JointType::kRevolute:
      tau[0] += axis[0].angular.dot(f.torque);
      return;
    case JointType::kPrismatic:
      tau[0] += axis[0].linear.dot(f.force);
      return;
    case JointType::kPlanar:
      tau[0] += axis[0].linear.dot(f.force);
      tau[1] += axis[1].linear.dot(f.force);
      tau[2] += axis[2].angular.dot(f.torque);
      return;
    case JointType::kSpherical:
      for (int j = 0; j < 3; ++j) tau[j] += axis[j].angular.dot(f.torque);
      return;
    case JointType::kFloating:
      for (int j = 0; j < 3; ++j) tau[j] += axis[j].linear.dot(f.force);
      for (int j = 3; j < 6; ++j) tau[j] += axis[j].angular.dot(f.torque);
      return;
  }
}

/// True where linear velocities are kept in the axes of J while the body turns: then
/// dS/dt v = (0, -omega_J x linear_J) seen from the body.
constexpr bool joint_axes_turn(JointType type) {
  return type == JointType::kPlanar || type == JointType::kFloating;
}

}  // namespace counterpoint
