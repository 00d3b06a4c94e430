// What each joint type does, by switch: pose across the joint, velocity, motion subspace.
// Conventions of q and v: model/joint.h. S is in body axes at the body origin.
#pragma once

#include <cmath>

#include "counterpoint/model/joint.h"

namespace counterpoint {

/// Pose X_PB of a body in its parent, from the joint's coordinates q.
inline Pose joint_pose(const Pose& X_PJ, JointType type, const double* q) {
  switch (type) {
    case JointType::kRevolute: {
      const double s = std::sin(q[0]), c = std::cos(q[0]);
      Pose X = X_PJ;
      X.rotation.col(0) = c * X_PJ.rotation.col(0) + s * X_PJ.rotation.col(1);
      X.rotation.col(1) = c * X_PJ.rotation.col(1) - s * X_PJ.rotation.col(0);
      return X;
    }
    case JointType::kPrismatic:
      return {X_PJ.rotation, X_PJ.translation + q[0] * X_PJ.rotation.col(2)};
    case JointType::kPlanar: {
      Pose X = joint_pose(X_PJ, JointType::kRevolute, q + 2);
      X.translation += q[0] * X_PJ.rotation.col(0) + q[1] * X_PJ.rotation.col(1);
      return X;
    }
    case JointType::kSpherical:
      return {X_PJ.rotation * Quaternion(q[0], q[1], q[2], q[3]).toRotationMatrix(),
              X_PJ.translation};
    case JointType::kFloating:
      return {X_PJ.rotation * Quaternion(q[3], q[4], q[5], q[6]).toRotationMatrix(),
              X_PJ * Vector3(q[0], q[1], q[2])};
  }
  return X_PJ;
}

/// Rotation R_JB across the joint, for the types whose S depends on it.
inline Matrix3 joint_rotation(const Pose& X_PJ, const Pose& X_PB) {
  return X_PJ.rotation.transpose() * X_PB.rotation;
}

/// S a: the joint's motion in body axes for rates a. R_JB is read for planar and floating joints only.
inline Motion joint_motion(JointType type, const Matrix3& R_JB, const double* a) {
  switch (type) {
    case JointType::kRevolute: return {Vector3(0, 0, a[0]), Vector3::Zero()};
    case JointType::kPrismatic: return {Vector3::Zero(), Vector3(0, 0, a[0])};
    case JointType::kPlanar:
      return {Vector3(0, 0, a[2]), R_JB.transpose() * Vector3(a[0], a[1], 0)};
    case JointType::kSpherical: return {Vector3(a[0], a[1], a[2]), Vector3::Zero()};
    case JointType::kFloating:
      return {Vector3(a[3], a[4], a[5]), R_JB.transpose() * Vector3(a[0], a[1], a[2])};
  }
  return {};
}

/// tau += S' f: the force along the joint's coordinates.
inline void add_joint_force(JointType type, const Matrix3& R_JB, const Force& f, double* tau) {
  switch (type) {
    case JointType::kRevolute: tau[0] += f.torque.z(); return;
    case JointType::kPrismatic: tau[0] += f.force.z(); return;
    case JointType::kPlanar: {
      const Vector3 force = R_JB * f.force;
      tau[0] += force.x();
      tau[1] += force.y();
      tau[2] += f.torque.z();
      return;
    }
    case JointType::kSpherical:
      for (int i = 0; i < 3; ++i) tau[i] += f.torque[i];
      return;
    case JointType::kFloating: {
      const Vector3 force = R_JB * f.force;
      for (int i = 0; i < 3; ++i) tau[i] += force[i];
      for (int i = 0; i < 3; ++i) tau[3 + i] += f.torque[i];
      return;
    }
  }
}

/// True if S turns with the joint, so that dS/dt v = (0, -omega_J x linear_J).
constexpr bool joint_axes_turn(JointType type) {
  return type == JointType::kPlanar || type == JointType::kFloating;
}

/// Column j of S, in body axes.
inline Motion joint_axis(JointType type, const Matrix3& R_JB, int j) {
  double unit[6] = {0, 0, 0, 0, 0, 0};
  unit[j] = 1.0;
  return joint_motion(type, R_JB, unit);
}

}  // namespace counterpoint
