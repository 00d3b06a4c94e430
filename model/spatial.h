// Vectors, rotations and spatial algebra, in double precision: Eigen types; quaternions and the
// exponential map; poses, spatial velocities (motions), spatial forces (wrenches), inertias.
// Monogram notation: X_AB is the pose of frame B in frame A; V_WB the spatial velocity of B in W. A
// spatial quantity refers to the origin and the axes of the frame it is expressed in.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>

namespace counterpoint {

using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using VectorX = Eigen::VectorXd;
using Matrix3 = Eigen::Matrix3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using MatrixX = Eigen::MatrixXd;
using Quaternion = Eigen::Quaterniond;
using VectorRef = Eigen::Ref<const VectorX>;
using VectorOut = Eigen::Ref<VectorX>;

/// Standard gravity [m/s^2], ISO 80000-3. Also the g0 of contact smoothing, for any gravity of the
/// scene.
inline constexpr double kStandardGravity = 9.80665;

/// Error in the user's input (a file, an element, a value). The message names the place, the
/// expected input and a remedy. Commands exit with code 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

// ---- Rotations: unit quaternions and matrices, exponential map, axis alignment.

/// Returns the matrix of the cross product: skew(a) * b = a x b.
inline Matrix3 skew(const Vector3& a) {
  Matrix3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Returns the rotation matrix of URDF's fixed-axis roll, pitch, yaw [rad]: Rz(yaw) Ry(pitch)
/// Rx(roll).
Matrix3 rotation_from_rpy(double roll, double pitch, double yaw);

/// Returns the unit quaternion of a rotation vector [rad] (axis times angle), to round-off at every
/// angle.
Quaternion quaternion_exp(const Vector3& rotation_vector);

/// Returns the rotation vector [rad], angle in [0, pi], of a unit quaternion: the inverse of
/// quaternion_exp.
Vector3 quaternion_log(const Quaternion& q);

/// Returns a rotation that maps the z axis to the unit vector `axis`; the identity when `axis` is
/// z, and free of round-off when it is a coordinate axis.
Matrix3 rotation_z_to(const Vector3& axis);

/// Returns a right-handed frame (t1, t2, n), as columns, whose third axis is the unit vector n. It
/// depends on n only, continuously except at n = -z (Duff et al. 2017, "Building an orthonormal
/// basis, revisited").
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

// ---- Spatial algebra.

/// Spatial velocity or acceleration: angular [rad/s, rad/s^2], linear [m/s, m/s^2] of the frame
/// origin.
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
  /// Returns the velocity [m/s] of the body-fixed point at position p [m] from the origin.
  Vector3 at(const Vector3& p) const { return linear + angular.cross(p); }
};

/// Spatial force: torque [N m] about the frame origin, force [N]. Also spatial momentum and
/// impulse.
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

/// Returns the power [W] of a force along a motion, both in the same frame.
inline double dot(const Motion& v, const Force& f) {
  return v.angular.dot(f.torque) + v.linear.dot(f.force);
}

/// Motion cross product v x m: rate of change of a motion m that is fixed in a frame moving with v
/// (Featherstone 2008, eq. 2.31).
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

  /// Transforms a point [m] from frame B to frame A.
  Vector3 operator*(const Vector3& p_B) const { return rotation * p_B + translation; }
  Pose operator*(const Pose& X_BC) const {
    return {rotation * X_BC.rotation, rotation * X_BC.translation + translation};
  }
  Pose inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
  /// Transforms a motion from frame B to frame A.
  Motion operator*(const Motion& v_B) const {
    const Vector3 angular = rotation * v_B.angular;
    return {angular, rotation * v_B.linear + translation.cross(angular)};
  }
  /// Transforms a motion from frame A to frame B.
  Motion inverse_apply(const Motion& v_A) const {
    return {rotation.transpose() * v_A.angular,
            rotation.transpose() * (v_A.linear - translation.cross(v_A.angular))};
  }
  /// Transforms a force from frame B to frame A.
  Force operator*(const Force& f_B) const {
    const Vector3 force = rotation * f_B.force;
    return {rotation * f_B.torque + translation.cross(force), force};
  }
  /// Transforms a force from frame A to frame B.
  Force inverse_apply(const Force& f_A) const {
    return {rotation.transpose() * (f_A.torque - translation.cross(f_A.force)),
            rotation.transpose() * f_A.force};
  }
};

/// Inertia of one rigid body about its centre of mass, in the axes of the body frame.
struct SpatialInertia {
  double mass = 0.0;                     ///< [kg]
  Vector3 center = Vector3::Zero();      ///< centre of mass in the body frame [m]
  Matrix3 rotational = Matrix3::Zero();  ///< about the centre of mass [kg m^2], symmetric

  /// Returns the spatial momentum about the body origin of a body that moves with v.
  Force operator*(const Motion& v) const {
    const Vector3 momentum = mass * v.at(center);
    return {rotational * v.angular + center.cross(momentum), momentum};
  }
  /// Returns the inertia of both bodies welded together (same frame).
  SpatialInertia operator+(const SpatialInertia& o) const;
  /// Transforms this inertia from frame B to frame A.
  SpatialInertia transformed(const Pose& X_AB) const {
    return {mass, X_AB * center, X_AB.rotation * rotational * X_AB.rotation.transpose()};
  }
  /// Returns the 6x6 matrix over (angular, linear) at the body origin [kg m^2, kg m, kg].
  Matrix6 matrix() const;
};

}  // namespace counterpoint
