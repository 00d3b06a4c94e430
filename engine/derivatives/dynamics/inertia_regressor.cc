#include "counterpoint/engine/derivatives/dynamics/inertia_regressor.h"

#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// Returns L(w), 3 x 6, with I w = L(w) (Ixx, Ixy, Iyy, Ixz, Iyz, Izz).
Eigen::Matrix<double, 3, 6> second_moments(const Vector3& w) {
  Eigen::Matrix<double, 3, 6> L;
  L << w.x(), w.y(), 0.0, w.z(), 0.0, 0.0,  //
      0.0, w.x(), w.y(), 0.0, w.z(), 0.0,   //
      0.0, 0.0, 0.0, w.x(), w.y(), w.z();
  return L;
}

}  // namespace

InertiaRegressor::InertiaRegressor(const Model& model)
    : V_(model.num_bodies()), A_(model.num_bodies()), moving_(model.num_bodies()) {}

void InertiaRegressor::set_motion(const Model& model, const double* v, const double* a,
                                  const Vector3& gravity, const Kinematics& data) {
  A_[0] = {Vector3::Zero(), -gravity};
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const Motion* axis = &data.axis[body.v_index];
    A_[i] = shift(A_[body.parent], data.arm[i]);
    V_[i] = Motion();
    if (a != nullptr) A_[i] += joint_motion(body.joint_type, axis, a + body.v_index);
    if (v != nullptr) {
      // Velocity-dependent acceleration dS/dt v + V x S v, as in compute_velocities.
      const Motion V_J = joint_motion(body.joint_type, axis, v + body.v_index);
      V_[i] = V_J;
      if (body.parent != 0) {
        V_[i] += shift(V_[body.parent], data.arm[i]);
        A_[i] += cross(V_[i], V_J);
      }
      if (joint_axes_turn(body.joint_type)) A_[i].linear -= V_J.angular.cross(V_J.linear);
    }
    const Matrix3 to_body = data.X_WB[i].rotation.transpose();
    moving_[i] = {to_body * V_[i].angular, to_body * A_[i].angular,
                  to_body * (A_[i].linear + V_[i].angular.cross(V_[i].linear))};
  }
}

void InertiaRegressor::compute(const Model& model, const VectorRef& v, const VectorRef& a,
                               const Vector3& gravity, const Data& data, MatrixX& Y) {
  set_motion(model, data.has_coriolis ? v.data() : nullptr, a.data(), gravity, data);
  const int columns = 10 * model.num_joints();
  if (Y.rows() != model.nv() || Y.cols() != columns) Y.resize(model.nv(), columns);
  Y.setZero();
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Moving& m = moving_[b];
    const Matrix3& R = data.X_WB[b].rotation;
    const Matrix3 omega = skew(m.omega);
    // Torque about the body's origin, and force, in W.
    Eigen::Matrix<double, 3, 10> torque, force;
    force.col(0) = R * m.a;
    force.middleCols<3>(1) = R * (skew(m.alpha) + omega * omega);
    force.rightCols<6>().setZero();
    torque.col(0).setZero();
    torque.middleCols<3>(1) = -R * skew(m.a);
    torque.rightCols<6>() = R * (second_moments(m.alpha) + omega * second_moments(m.omega));
    for (int i = b; i != 0; i = model.body(i).parent) {
      const Body& body = model.body(i);
      for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
        const Motion& S = data.axis[k];
        Y.block<1, 10>(k, 10 * (b - 1)).noalias() =
            S.angular.transpose() * torque + S.linear.transpose() * force;
      }
      torque += skew(data.arm[i]) * force;
    }
  }
}

void InertiaRegressor::add(const Model& model, int body, const InertialParameters& change,
                           double factor, const Kinematics& data, VectorOut tau) const {
  const Moving& m = moving_[body];
  const Vector3 moment = change.segment<3>(1);
  const Matrix3 I = inertia_tensor(change);
  const Vector3 force =
      change[0] * m.a + m.alpha.cross(moment) + m.omega.cross(m.omega.cross(moment));
  const Vector3 torque = moment.cross(m.a) + I * m.alpha + m.omega.cross(I * m.omega);
  const Matrix3& R = data.X_WB[body].rotation;
  Force f{factor * (R * torque), factor * (R * force)};
  for (int i = body; i != 0; i = model.body(i).parent) {
    const Body& joint = model.body(i);
    for (int k = joint.v_index; k < joint.v_index + joint_nv(joint.joint_type); ++k)
      tau[k] += dot(data.axis[k], f);
    f = shift(f, data.arm[i]);
  }
}

}  // namespace counterpoint
