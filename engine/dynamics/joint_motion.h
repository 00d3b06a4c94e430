// Motion subspace of each joint type, and products with it. Conventions of q and v: model/model.h.
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

/// Writes the columns of S in axes of W at the body's origin to axis[0 ... nv).
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

/// Returns S a: the motion across the joint for rates a.
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

/// Computes tau += S' f, the force along the joint's coordinates.
[[gnu::always_inline]] inline void add_joint_force(JointType type, const Motion* axis,
                                                   const Force& f, double* tau) {
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

/// Whether linear velocities are expressed in the axes of J while the body rotates; then dS/dt v =
/// (0, -omega_J x linear_J) in the body frame.
constexpr bool joint_axes_turn(JointType type) {
  return type == JointType::kPlanar || type == JointType::kFloating;
}

}  // namespace counterpoint
