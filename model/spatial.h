// Spatial algebra: poses, spatial velocities (motions), spatial forces (wrenches), inertias.
// Monogram notation: X_AB is the pose of frame B in frame A; V_WB the spatial velocity of B in W.
// A spatial quantity is written at the origin of, and in the axes of, the frame it is expressed in.
#pragma once

#include "counterpoint/model/rotation.h"
#include "counterpoint/model/types.h"

namespace counterpoint {

/// Spatial velocity or acceleration: angular [rad/s, rad/s^2], linear [m/s, m/s^2] of the frame origin.
struct Motion {
  Vector3 angular = Vector3::Zero();
  Vector3 linear = Vector3::Zero();

  Motion operator+(const Motion& o) const { return {angular + o.angular, linear + o.linear}; }
  Motion operator-(const Motion& o) const { return {angular - o.angular, linear - o.linear}; }
  Motion operator*(double s) const { return {angular * s, linear * s}; }
  Motion& operator+=(const Motion& o) {
    angular += o.angular;
    linear += o.linear;
    return *this;
  }
  /// Velocity [m/s] of the body-fixed point at position p [m] from the origin.
  Vector3 at(const Vector3& p) const { return linear + angular.cross(p); }
};

/// Spatial force: torque [N m] about the frame origin, force [N]. Also spatial momentum and impulse.
struct Force {
  Vector3 torque = Vector3::Zero();
  Vector3 force = Vector3::Zero();

  Force operator+(const Force& o) const { return {torque + o.torque, force + o.force}; }
  Force operator-(const Force& o) const { return {torque - o.torque, force - o.force}; }
  Force operator*(double s) const { return {torque * s, force * s}; }
  Force& operator+=(const Force& o) {
    torque += o.torque;
    force += o.force;
    return *this;
  }
  Force& operator-=(const Force& o) {
    torque -= o.torque;
    force -= o.force;
    return *this;
  }
};

/// Power [W] of a force along a motion, both in the same frame.
inline double dot(const Motion& v, const Force& f) {
  return v.angular.dot(f.torque) + v.linear.dot(f.force);
}

/// Motion cross product v x m: rate of change of m carried along by v (Featherstone 2008, eq. 2.31).
inline Motion cross(const Motion& v, const Motion& m) {
  return {v.angular.cross(m.angular), v.angular.cross(m.linear) + v.linear.cross(m.angular)};
}

/// Force cross product v x* f (Featherstone 2008, eq. 2.32).
inline Force cross(const Motion& v, const Force& f) {
  return {v.angular.cross(f.torque) + v.linear.cross(f.force), v.angular.cross(f.force)};
}

/// Rigid transform X_AB: orientation R_AB and origin p_AB [m] of frame B in frame A.
struct Pose {
  Matrix3 rotation = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();

  /// A point given in B, in A.
  Vector3 operator*(const Vector3& p_B) const { return rotation * p_B + translation; }
  Pose operator*(const Pose& X_BC) const {
    return {rotation * X_BC.rotation, rotation * X_BC.translation + translation};
  }
  Pose inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation)};
  }
  /// A motion expressed in B, expressed in A.
  Motion operator*(const Motion& v_B) const {
    const Vector3 angular = rotation * v_B.angular;
    return {angular, rotation * v_B.linear + translation.cross(angular)};
  }
  /// A motion expressed in A, expressed in B.
  Motion inverse_apply(const Motion& v_A) const {
    return {rotation.transpose() * v_A.angular,
            rotation.transpose() * (v_A.linear - translation.cross(v_A.angular))};
  }
  /// A force expressed in B, expressed in A.
  Force operator*(const Force& f_B) const {
    const Vector3 force = rotation * f_B.force;
    return {rotation * f_B.torque + translation.cross(force), force};
  }
  /// A force expressed in A, expressed in B.
  Force inverse_apply(const Force& f_A) const {
    return {rotation.transpose() * (f_A.torque - translation.cross(f_A.force)),
            rotation.transpose() * f_A.force};
  }
};

/// Inertia of one rigid body about its centre of mass, in the axes of the body frame.
struct SpatialInertia {
  double mass = 0.0;                      ///< [kg]
  Vector3 center = Vector3::Zero();       ///< centre of mass in the body frame [m]
  Matrix3 rotational = Matrix3::Zero();   ///< about the centre of mass [kg m^2], symmetric

  /// Spatial momentum of the body moving with v, at the body origin.
  Force operator*(const Motion& v) const {
    const Vector3 momentum = mass * v.at(center);
    return {rotational * v.angular + center.cross(momentum), momentum};
  }
  /// Both bodies, welded together (same frame).
  SpatialInertia operator+(const SpatialInertia& o) const;
  /// The same body seen from frame A, this being expressed in B.
  SpatialInertia transformed(const Pose& X_AB) const {
    return {mass, X_AB * center, X_AB.rotation * rotational * X_AB.rotation.transpose()};
  }
  /// 6x6 matrix over (angular, linear), at the body origin [kg m^2, kg m, kg].
  Matrix6 matrix() const;
};

}  // namespace counterpoint
