#include "counterpoint/engine/derivatives/constraints/closure_derivatives.h"

#include <Eigen/LU>
#include <algorithm>

#include "counterpoint/engine/constraints/closures.h"
#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

template <class Visit>
void for_each_on_path(const Model& model, int leaf, Visit visit) {
  for (int i = leaf; i != 0; i = model.body(i).parent) {
    const int first = model.body(i).v_index;
    for (int k = first; k < first + joint_nv(model.body(i).joint_type); ++k) visit(i, k);
  }
}

/// Returns the slope [1/s] of the recovery speed by the error, and the speed [m/s or rad/s], whose
/// norm is at most max_recovery_speed.
Matrix3 recovery(const ContactOptions& options, double h, const Vector3& error, Vector3& speed) {
  const double slope = options.stabilization / h;
  speed = slope * error;
  const double size = speed.norm();
  if (!(size > options.max_recovery_speed)) return slope * Matrix3::Identity();
  const Vector3 along = speed / size;
  const double share = options.max_recovery_speed / size;
  speed *= share;
  return slope * share * (Matrix3::Identity() - along * along.transpose());
}

}  // namespace

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
                     &y_, &reached_q_, &reached_w_, &carried_})
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

ClosureDerivator::Error ClosureDerivator::error(const Closure& closure, bool turns,
                                                const Kinematics& data) {
  const Pose &X_A = data.X_WB[closure.body_a], &X_B = data.X_WB[closure.body_b];
  Error out;
  if (!turns) {
    out.apart = X_B * closure.X_BC.translation - X_A * closure.X_AC.translation;
    return out;
  }
  const Matrix3 R_WA = X_A.rotation * closure.X_AC.rotation;
  const Matrix3 turn = X_B.rotation * closure.X_BC.rotation * R_WA.transpose();
  out.apart = quaternion_log(Quaternion(turn));
  // For small rotations t_A, t_B of the bodies: exp(t_B) turn exp(-t_A) = exp(t_B - turn t_A) turn.
  out.of_b = right_jacobian(out.apart).transpose().inverse();
  out.of_a = out.of_b * turn;
  return out;
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
                     &y_, &reached_q_, &reached_w_, &carried_})
    m->leftCols(size).setZero();
}

/// Adds the contribution of one body to rotational rows.
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
    y_.col(s) += sign * (e.cross(side.moving.W.angular) + c.P_w.angular);
    if (sign < 0.0) carried_.col(s) = e;
  });
}

/// Adds the contribution of one body to translational rows. spin: angular velocity of B relative to
/// A with w; the place of the rows moves with it.
void ClosureDerivator::add_points(const Model& model, const Side& side, const Vector3& spin) {
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
        0.5 * spin.cross(at_anchor);
    if (sign < 0.0) carried_.col(s) = e;
  });
}

/// Adds the derivatives of the error at the pose reached, by q and by w.
void ClosureDerivator::add_reached(const Model& model, const Side& side, const Pose& X_BC,
                                   bool turns, const Error& error) {
  if (side.body == 0) return;
  const Vector3 anchor = reached_->X_WB[side.body] * X_BC.translation;
  const Matrix3& of = side.sign > 0.0 ? error.of_b : error.of_a;
  for (int i = side.body; i != 0; i = model.body(i).parent) {
    const Body& body = model.body(i);
    const Vector3 arm = anchor - reached_->X_WB[i].translation;
    const int nv = joint_nv(body.joint_type), linear = joint_num_linear(body.joint_type);
    Eigen::Matrix<double, 3, 6> by;
    for (int j = 0; j < nv; ++j) {
      const Motion& axis = reached_->axis[body.v_index + j];
      by.col(j) = side.sign * (turns ? Vector3(of * axis.angular) : axis.at(arm));
    }
    // q (+) h w is displaced by P dq + h Q dw (rotation_maps.h).
    Eigen::Matrix<double, 3, 6> by_velocity = by;
    if (nv - linear == 3) {
      const Vector3 turn = turn_.segment<3>(body.v_index + linear);
      by_velocity.middleCols<3>(linear) = by.middleCols<3>(linear) * right_jacobian(turn);
      by.middleCols<3>(linear) =
          (by.middleCols<3>(linear) * quaternion_exp(-turn).toRotationMatrix()).eval();
    }
    for (int j = 0; j < nv; ++j) {
      const int s = slot_[body.v_index + j];
      reached_q_.col(s) += by.col(j);
      reached_w_.col(s) += by_velocity.col(j);
    }
  }
}

/// Replaces vectors between the anchors by the change of their length, in the first row.
void ClosureDerivator::project(const Vector3& apart, const Vector3& parting, const Vector3& bend,
                               const Vector3& apart_reached, const Vector3& y) {
  const double d = apart.norm(), d_reached = apart_reached.norm();
  const bool directed = d > kNoDirection;
  const Vector3 n = directed ? Vector3(apart / d) : Vector3::UnitZ();
  const Vector3 n_reached = d_reached > 0.0 ? Vector3(apart_reached / d_reached) : n;
  const double inverse = directed ? 1.0 / d : 0.0, along = n.dot(parting);
  const Vector3 across = parting - along * n;
  for (int s = 0; s < size; ++s) {
    const Vector3 moved = error_.col(s);
    const double longer = n.dot(moved);
    const Vector3 dn = (moved - longer * n) * inverse, rate = rate_.col(s);
    const auto first = [&](Columns& m, double x) { m.col(s) = Vector3(x, 0.0, 0.0); };
    // Acceleration of the distance: n.c + |across|^2 / d.
    first(curvature_, n.dot(curvature_.col(s)) + dn.dot(bend) +
                          inverse * (2.0 * across.dot(rate - along * dn) -
                                     across.squaredNorm() * inverse * longer));
    first(curvature_v_, n.dot(curvature_v_.col(s)) + 2.0 * inverse * across.dot(moved));
    first(y_, n.dot(y_.col(s)) + dn.dot(y));
    first(error_, longer);
    first(jacobian, n.dot(jacobian.col(s)));
    first(reached_q_, n_reached.dot(reached_q_.col(s)));
    first(reached_w_, n_reached.dot(reached_w_.col(s)));
    carried_.col(s).setZero();
  }
}

/// Returns the body on the two paths that rotates fastest with w, and its angular speed [rad/s].
int ClosureDerivator::fastest(const Model& model, const PairConstraint& pair, double& speed) const {
  int out = 0;
  double square = 0.0;
  for (const int leaf : {pair.body_a, pair.body_b})
    for (int i = leaf; i != 0; i = model.body(i).parent) {
      if (moving_[i].W.angular.squaredNorm() <= square) continue;
      square = moving_[i].W.angular.squaredNorm();
      out = i;
    }
  speed = std::sqrt(square);
  return out;
}

/// Adds the change of the aimed share with the angular speed of a body; slope: of the share [s].
void ClosureDerivator::add_share_slope(const Model& model, double slope, int body,
                                       const Vector3& by_share) {
  const Vector3 along = moving_[body].W.angular.normalized();
  for_each_on_path(model, body, [&](int, int k) {
    const int s = slot_[k];
    by_q.col(s) += slope * along.dot(columns_[k].P_w.angular) * by_share;
    by_w.col(s) += slope * along.dot(columns_[k].S.angular) * by_share;
  });
}

void ClosureDerivator::compute(const Model& model, const ContactOptions& options, double h,
                               const Closure& closure, const PairConstraint& pair,
                               const Kinematics& data, bool aimed) {
  const bool turns = pair.first == 3, distance = closure.type == ClosureType::kDistance;
  const Side a = side(model, pair.body_a, -1.0, closure.X_AC, pair.position, data);
  const Side b = side(model, pair.body_b, 1.0, closure.X_BC, pair.position, data);
  const Error here = error(closure, turns, data);
  const Error there = aimed ? error(closure, turns, *reached_) : here;
  list(model, pair);
  const Vector3 spin = b.moving.W.angular - a.moving.W.angular;
  for (const Side* s : {&a, &b}) {
    if (turns) {
      add_turns(model, *s, here);
    } else {
      add_points(model, *s, spin);
    }
    if (aimed) add_reached(model, *s, s == &a ? closure.X_AC : closure.X_BC, turns, there);
  }
  const Vector3 parting = b.u - a.u;
  Vector3 e = here.apart, e_reached = there.apart;
  Vector3 y = turns ? spin : Vector3(b.moving.W.at(b.place) - a.moving.W.at(a.place));
  Vector3 c = turns ? Vector3(b.moving.A.angular - a.moving.A.angular) : Vector3(b.a - a.a);
  if (distance) {
    project(here.apart, parting, c, there.apart, y);
    const Vector3& n = pair.frame.col(0);
    const double d = here.apart.norm(), along = n.dot(parting);
    const double turning = d > kNoDirection ? (parting.squaredNorm() - along * along) / d : 0.0;
    e = Vector3(d - closure.length, 0.0, 0.0);
    e_reached = Vector3(there.apart.norm() - closure.length, 0.0, 0.0);
    y = Vector3(n.dot(y), 0.0, 0.0);
    c = Vector3(n.dot(c) + turning, 0.0, 0.0);
  }
  const Matrix3 recovered = recovery(options, h, e, bias);
  double speed = 0.0;
  const int body = aimed ? fastest(model, pair, speed) : 0;
  const double share = aimed ? share_aimed(h * speed) : 0.0;
  const Vector3 by_curvature = 0.5 * h * c, by_aim = (e_reached - e) / h - y;
  bias += (1.0 - share) * by_curvature;
  if (aimed) bias += share * by_aim;
  const double rest = 0.5 * h * (1.0 - share);
  for (int s = 0; s < size; ++s) {
    by_q.col(s) =
        recovered * error_.col(s) + rest * curvature_.col(s) - Vector3(carried_.col(s)).cross(bias);
    by_v.col(s) = rest * curvature_v_.col(s);
    if (!aimed) continue;
    by_q.col(s) += share * ((reached_q_.col(s) - error_.col(s)) / h - y_.col(s));
    by_w.col(s) = share * (reached_w_.col(s) - jacobian.col(s));
  }
  const double slope = aimed ? h * share_aimed_slope(h * speed) : 0.0;
  if (slope != 0.0) add_share_slope(model, slope, body, by_aim - by_curvature);
}

void ClosureDerivator::add_to(MatrixX& out, double scale, const Columns& slopes) const {
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i)
      out(coordinates[i], coordinates[j]) += scale * jacobian.col(i).dot(slopes.col(j));
}

ContactMotion closure_motion(const Closure& closure, const PairConstraint& pair,
                             const Kinematics& data) {
  const Vector3 to_b = data.X_WB[closure.body_b] * closure.X_BC.translation - pair.position;
  Eigen::Matrix<double, 3, 6> anchor;
  anchor << -skew(to_b), Matrix3::Identity();
  ContactMotion motion;
  motion.point = 0.5 * anchor;
  motion.normal.setZero();
  motion.gap.setZero();
  const double d = 2.0 * to_b.norm();  // the place is halfway between the anchors
  if (closure.type == ClosureType::kDistance && d > kNoDirection) {
    const Vector3& n = pair.frame.col(0);
    motion.normal = (anchor - n * (n.transpose() * anchor)) / d;
  }
  return motion;
}

}  // namespace counterpoint
