#include <algorithm>

#include "counterpoint/engine/derivatives/constraints/closure_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

ClosureDerivator::ClosureDerivator(const Model& model)
    : held_(static_cast<size_t>(model.num_trees()), 0) {
  if (model.closures().empty()) return;
  for (const Closure& closure : model.closures())
    for (const int body : {closure.body_a, closure.body_b})
      if (body != 0) held_[static_cast<size_t>(model.body(body).tree)] = 1;
  const auto nv = static_cast<size_t>(model.nv());
  columns_.resize(nv);
  coordinates.resize(nv);
  slot_.assign(nv, -1);
  moving_.resize(static_cast<size_t>(model.num_bodies()));
  reached_.emplace(model);
  q_reached_ = model.default_q();
  turn_ = VectorX::Zero(model.nv());
  for (Columns* m : {&jacobian, &by_q, &by_v, &by_w, &error_, &rate_, &curvature_, &curvature_v_,
                     &y_, &reached_q_, &reached_w_, &carried_, &turned_q_, &turned_w_, &omega_,
                     &alpha_, &alpha_v_, &spin_})
    m->setZero(3, model.nv());
}

void ClosureDerivator::begin(const Model& model, const Kinematics& data, const VectorRef& v) {
  for (int t = 0; t < model.num_trees(); ++t) {
    if (!held_[static_cast<size_t>(t)]) continue;
    const Tree& tree = model.trees()[t];
    for (int i = tree.body_begin; i < tree.body_end; ++i) {
      const Body& body = model.body(i);
      const Vector3 origin = data.X_WB[i].translation - TreeSweep::reference(tree, data);
      Motion V, A;
      if (body.parent != 0) {
        V = moving_[body.parent].V;
        A = moving_[body.parent].A;
      }
      // Translations, along axes of the parent, come before the rotation.
      const int linear = joint_num_linear(body.joint_type), nv = joint_nv(body.joint_type);
      for (const auto& [first, end] : {std::pair(0, linear), std::pair(linear, nv)}) {
        Motion across;
        for (int k = body.v_index + first; k < body.v_index + end; ++k) {
          Column& column = columns_[k];
          const Motion& axis = data.axis[k];
          column.S = {axis.angular, axis.linear + origin.cross(axis.angular)};
          column.P = cross(V, column.S);
          column.PP = cross(A, column.S) + cross(V, column.P);
          across += column.S * v[k];
        }
        const Motion carrier = V;
        V += across;
        A += cross(carrier, across);
        const bool turning = first == linear && end - first > 1;  // about body-fixed axes
        for (int k = body.v_index + first; k < body.v_index + end; ++k)
          columns_[k].D = columns_[k].P + (turning ? cross(V, columns_[k].S) : columns_[k].P);
      }
      moving_[i].V = V;
      moving_[i].A = A;
    }
  }
}

void ClosureDerivator::aim(const Model& model, double h, const VectorRef& q, const VectorRef& w) {
  turn_ = h * w;
  for (int t = 0; t < model.num_trees(); ++t) {
    if (!held_[static_cast<size_t>(t)]) continue;
    const Tree& tree = model.trees()[t];
    const BodyRange bodies = {tree.body_begin, tree.body_end};
    integrate_configuration(model, q, w, h, bodies, q_reached_);
    compute_poses(model, q_reached_, bodies, *reached_);
    for (int i = tree.body_begin; i < tree.body_end; ++i) {
      const Body& body = model.body(i);
      Motion W = body.parent != 0 ? moving_[body.parent].W : Motion();
      const int linear = joint_num_linear(body.joint_type), nv = joint_nv(body.joint_type);
      for (const auto& [first, end] : {std::pair(0, linear), std::pair(linear, nv)}) {
        Motion across;
        for (int k = body.v_index + first; k < body.v_index + end; ++k) {
          columns_[k].P_w = cross(W, columns_[k].S);
          across += columns_[k].S * w[k];
        }
        W += across;
      }
      moving_[i].W = W;
    }
  }
}

ClosureDerivator::Side ClosureDerivator::side(const Model& model, int body, double sign,
                                              const Pose& X_BC, const Vector3& place,
                                              const Kinematics& data) const {
  Side side;
  side.body = body;
  side.sign = sign;
  if (body == 0) return side;
  const Vector3& reference = TreeSweep::reference(model.trees()[model.body(body).tree], data);
  side.anchor = data.X_WB[body] * X_BC.translation - reference;
  side.place = place - reference;
  side.moving = moving_[body];
  side.u = side.moving.V.at(side.anchor);
  side.a = side.moving.A.at(side.anchor) + side.moving.V.angular.cross(side.u);
  return side;
}

/// Lists the coordinates of both paths once each, and clears their columns.
void ClosureDerivator::list(const Model& model, const PairConstraint& pair) {
  for (int i = 0; i < size; ++i) slot_[coordinates[i]] = -1;
  size = 0;
  for (const int body : {pair.body_a, pair.body_b})
    for_each_on_path(model, body, [&](int, int k) {
      if (slot_[k] >= 0) return;
      slot_[k] = size;
      coordinates[size++] = k;
    });
  for (Columns* m : {&jacobian, &by_q, &by_v, &by_w, &error_, &rate_, &curvature_, &curvature_v_,
                     &y_, &reached_q_, &reached_w_, &carried_, &turned_q_, &turned_w_, &omega_,
                     &alpha_, &alpha_v_, &spin_})
    m->leftCols(size).setZero();
}

/// Adds the contribution of one body to rows of angles.
void ClosureDerivator::add_turns(const Model& model, const Side& side, const Error& error) {
  const double sign = side.sign;
  const Vector3 &omega = side.moving.V.angular, &alpha = side.moving.A.angular;
  for_each_on_path(model, side.body, [&](int, int k) {
    const Column& c = columns_[k];
    const Vector3& e = c.S.angular;
    const int s = slot_[k];
    jacobian.col(s) += sign * e;
    error_.col(s) += sign * ((sign > 0.0 ? error.of_b : error.of_a) * e);
    curvature_.col(s) += sign * (e.cross(alpha) + c.P.angular.cross(omega) + c.PP.angular);
    curvature_v_.col(s) += sign * (e.cross(omega) + c.D.angular);
    spin_.col(s) += sign * (e.cross(omega) + c.P.angular);
    y_.col(s) += sign * (e.cross(side.moving.W.angular) + c.P_w.angular);
  });
}

/// Adds the contribution of B to the rate and acceleration of the axis z on it, in place of those
/// of its angular velocity.
void ClosureDerivator::add_axis(const Model& model, const Side& b, const Vector3& z) {
  const Vector3 &omega = b.moving.V.angular, &alpha = b.moving.A.angular;
  const Vector3 u = omega.cross(z);
  curvature_.leftCols(size).setZero();
  curvature_v_.leftCols(size).setZero();
  for_each_on_path(model, b.body, [&](int, int k) {
    const Column& c = columns_[k];
    const Vector3 &e = c.S.angular, moved = e.cross(z);
    const Vector3 domega = e.cross(omega) + c.P.angular;
    const Vector3 dalpha = e.cross(alpha) + c.P.angular.cross(omega) + c.PP.angular;
    const Vector3 rate = domega.cross(z) + omega.cross(moved);
    const int s = slot_[k];
    rate_.col(s) = rate;
    curvature_.col(s) = dalpha.cross(z) + alpha.cross(moved) + domega.cross(u) + omega.cross(rate);
    curvature_v_.col(s) =
        Vector3(e.cross(omega) + c.D.angular).cross(z) + e.cross(u) + omega.cross(moved);
  });
}

/// Adds the contribution of one body to translational rows. spin: angular velocity of B relative to
/// A with w; the place of the rows moves with it. The place moves by `share` of the motion of the
/// body's anchor.
void ClosureDerivator::add_points(const Model& model, const Side& side, const Vector3& spin,
                                  double share) {
  const double sign = side.sign;
  const Motion& W = side.moving.W;
  for_each_on_path(model, side.body, [&](int, int k) {
    const Column& c = columns_[k];
    const Vector3 &e = c.S.angular, at_anchor = c.S.at(side.anchor), at_place = c.S.at(side.place);
    const int s = slot_[k];
    jacobian.col(s) += sign * at_place;
    error_.col(s) += sign * at_anchor;
    rate_.col(s) += sign * (e.cross(side.u) + c.P.at(side.anchor));
    curvature_.col(s) +=
        sign * (e.cross(side.a) + 2.0 * c.P.angular.cross(side.u) + c.PP.at(side.anchor));
    curvature_v_.col(s) += sign * (2.0 * e.cross(side.u) + c.D.at(side.anchor));
    y_.col(s) +=
        sign * (e.cross(W.at(side.place)) + at_place.cross(W.angular) + c.P_w.at(side.place)) +
        share * spin.cross(at_anchor);
  });
}

/// Adds the derivatives of A's rotation, angular velocity and angular acceleration.
void ClosureDerivator::add_carrier(const Model& model, const Side& a) {
  const Vector3 &omega = a.moving.V.angular, &alpha = a.moving.A.angular;
  for_each_on_path(model, a.body, [&](int, int k) {
    const Column& c = columns_[k];
    const Vector3& e = c.S.angular;
    const int s = slot_[k];
    carried_.col(s) = e;
    omega_.col(s) = e.cross(omega) + c.P.angular;
    alpha_.col(s) = e.cross(alpha) + c.P.angular.cross(omega) + c.PP.angular;
    alpha_v_.col(s) = e.cross(omega) + c.D.angular;
  });
}

/// Adds the derivatives of the error at the pose reached, by q and by w, and of A's rotation there.
void ClosureDerivator::add_reached(const Model& model, const Side& side, const Pose& X_BC,
                                   bool turns, const Error& error) {
  if (side.body == 0) return;
  const Vector3 anchor = reached_->X_WB[side.body] * X_BC.translation;
  const Matrix3& of = side.sign > 0.0 ? error.of_b : error.of_a;
  for (int i = side.body; i != 0; i = model.body(i).parent) {
    const Body& body = model.body(i);
    const Vector3 arm = anchor - reached_->X_WB[i].translation;
    const int nv = joint_nv(body.joint_type), linear = joint_num_linear(body.joint_type);
    Eigen::Matrix<double, 6, 6> by;  // error, rotation
    for (int j = 0; j < nv; ++j) {
      const Motion& axis = reached_->axis[body.v_index + j];
      by.col(j) << side.sign * (turns ? Vector3(of * axis.angular) : axis.at(arm)), axis.angular;
    }
    // q (+) h w is displaced by P dq + h Q dw (rotation_maps.h).
    Eigen::Matrix<double, 6, 6> by_velocity = by;
    if (nv - linear == 3) {
      const Vector3 turn = turn_.segment<3>(body.v_index + linear);
      by_velocity.middleCols<3>(linear) = by.middleCols<3>(linear) * right_jacobian(turn);
      by.middleCols<3>(linear) =
          (by.middleCols<3>(linear) * quaternion_exp(-turn).toRotationMatrix()).eval();
    }
    for (int j = 0; j < nv; ++j) {
      const int s = slot_[body.v_index + j];
      reached_q_.col(s) += by.col(j).head<3>();
      reached_w_.col(s) += by_velocity.col(j).head<3>();
      if (side.sign > 0.0) continue;
      turned_q_.col(s) += by.col(j).tail<3>();
      turned_w_.col(s) += by_velocity.col(j).tail<3>();
    }
  }
}

}  // namespace counterpoint
