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

ClosureDerivator::Error ClosureDerivator::error(const Closure& closure, const Pose& X_BC,
                                                const PairConstraint& pair,
                                                const Kinematics& data) {
  const Pose &X_A = data.X_WB[closure.body_a], &X_B = data.X_WB[closure.body_b];
  Error out;
  out.R_WA = X_A.rotation * closure.X_AC.rotation;
  if (pair.error == ClosureError::kAxis) {
    out.apart = X_B.rotation * X_BC.rotation.col(2);
    out.of_b = -skew(out.apart);
    out.of_a.setZero();
  } else if (pair.error == ClosureError::kTurn) {
    const Matrix3 turn = X_B.rotation * X_BC.rotation * out.R_WA.transpose();
    out.apart = quaternion_log(Quaternion(turn));
    // For small rotations t_A, t_B of the bodies: exp(t_B) turn exp(-t_A) = exp(t_B - turn t_A)
    // turn.
    out.of_b = right_jacobian(out.apart).transpose().inverse();
    out.of_a = out.of_b * turn;
  } else {
    out.apart = X_B * X_BC.translation - X_A * closure.X_AC.translation;
  }
  return out;
}

/// Replaces vectors between the anchors by the change of their length, in the first row. bend: the
/// acceleration follows from bend_of_distance.
void ClosureDerivator::project(double h, bool bend, const Vector3& parting, const Motions& m) {
  const Vector3 &apart = m.e, &apart_reached = m.e_reached;
  const double d = apart.norm(), d_reached = apart_reached.norm();
  const bool directed = d > kNoDirection;
  const Vector3 n = directed ? Vector3(apart / d) : Vector3::UnitZ();
  const Vector3 n_reached = d_reached > 0.0 ? Vector3(apart_reached / d_reached) : n;
  const double inverse = directed ? 1.0 / d : 0.0, along = n.dot(parting);
  const Vector3 across = parting - along * n;
  const Vector3 end = (apart + h * parting + 0.5 * h * h * m.c).normalized();
  for (int s = 0; s < size; ++s) {
    const Vector3 moved = error_.col(s), rate = rate_.col(s);
    const Vector3 c = curvature_.col(s), c_v = curvature_v_.col(s);
    const double longer = n.dot(moved);
    const Vector3 dn = (moved - longer * n) * inverse;
    const auto first = [&](Columns& of, double x) { of.col(s) = Vector3(x, 0.0, 0.0); };
    if (bend) {
      const double bent = end.dot(moved + h * rate + 0.5 * h * h * c) - longer -
                          h * (dn.dot(parting) + n.dot(rate));
      const double bent_v = end.dot(h * moved + 0.5 * h * h * c_v) - h * longer;
      first(curvature_, 2.0 / (h * h) * bent);
      first(curvature_v_, 2.0 / (h * h) * bent_v);
    } else {  // acceleration of the distance: n.c + |across|^2 / d
      first(curvature_, n.dot(c) + dn.dot(m.c) +
                            inverse * (2.0 * across.dot(rate - along * dn) -
                                       across.squaredNorm() * inverse * longer));
      first(curvature_v_, n.dot(c_v) + 2.0 * inverse * across.dot(moved));
    }
    first(y_, n.dot(y_.col(s)) + dn.dot(m.y));
    first(error_, longer);
    first(jacobian, n.dot(jacobian.col(s)));
    first(reached_q_, n_reached.dot(reached_q_.col(s)));
    first(reached_w_, n_reached.dot(reached_w_.col(s)));
    carried_.col(s).setZero();
  }
}

/// Replaces vectors between the anchors by their length, beyond that of the closure.
void ClosureDerivator::take_distance(const Closure& closure, const PairConstraint& pair, double h,
                                     const Vector3& parting, Motions& m) {
  const bool bend = closure.rope || pair.soft;
  project(h, bend, parting, m);
  const double sign = closure.rope ? -1.0 : 1.0;
  const Vector3 n = sign * pair.frame.col(0);
  const double d = m.e.norm(), along = n.dot(parting);
  const double turning = d > kNoDirection ? (parting.squaredNorm() - along * along) / d : 0.0;
  const double c =
      bend ? 2.0 / (h * h) * bend_of_distance(h, n, m.e, parting, m.c) : n.dot(m.c) + turning;
  m = {Vector3(sign * (d - closure.length), 0.0, 0.0), Vector3(sign * c, 0.0, 0.0),
       Vector3(sign * (m.e_reached.norm() - closure.length), 0.0, 0.0),
       Vector3(sign * n.dot(m.y), 0.0, 0.0)};
  if (!closure.rope) return;
  for (Columns* of : {&jacobian, &error_, &curvature_, &curvature_v_, &y_})
    of->leftCols(size) *= -1.0;
}

/// Takes a vector between A and B, and its derivatives, in axes carried along with A, and its
/// acceleration as seen there. u: its rate.
void ClosureDerivator::see_from_a(const PairConstraint& pair, const Side& a, const Vector3& u,
                                  const Error& here, const Error& there, Motions& m) {
  const Vector3 &omega = a.moving.V.angular, &alpha = a.moving.A.angular;
  const Vector3 r = m.e, r_reached = m.e_reached;
  const Matrix3 back = here.R_WA * there.R_WA.transpose();
  m.c = acceleration_seen(r, u, m.c, omega, alpha);
  m.e_reached = back * r_reached;
  for (int s = 0; s < size; ++s) {
    const Vector3 e = carried_.col(s), dr = error_.col(s), du = rate_.col(s);
    const Vector3 domega = omega_.col(s), dalpha = alpha_.col(s), dalpha_v = alpha_v_.col(s);
    const Vector3 dc = curvature_.col(s), dc_v = curvature_v_.col(s);
    curvature_.col(s) = acceleration_seen(dr, du, dc, omega, alpha) - dalpha.cross(r) +
                        domega.cross(omega.cross(r)) + omega.cross(domega.cross(r)) -
                        2.0 * domega.cross(u) - e.cross(m.c);
    curvature_v_.col(s) = dc_v - dalpha_v.cross(r) + e.cross(omega.cross(r)) +
                          omega.cross(e.cross(r)) - 2.0 * (e.cross(u) + omega.cross(dr));
    error_.col(s) = dr - e.cross(r);
    y_.col(s) -= e.cross(m.y);
    const Vector3 turned_q = turned_q_.col(s), turned_w = turned_w_.col(s);
    reached_q_.col(s) = back * (reached_q_.col(s) - turned_q.cross(r_reached));
    reached_w_.col(s) = back * (reached_w_.col(s) - turned_w.cross(r_reached));
    carried_.col(s).setZero();
  }
  if (pair.error != ClosureError::kAxis) return;
  const Matrix3 across = skew(here.R_WA.col(2));
  for (Vector3* v : {&m.e, &m.c, &m.e_reached}) *v = across * *v;
  for (Columns* of : {&error_, &curvature_, &curvature_v_, &reached_q_, &reached_w_})
    for (int s = 0; s < size; ++s) of->col(s) = across * Vector3(of->col(s));
}

/// Turns the rotation vector of a spring, and its derivatives, into the axes of A. spin: angular
/// velocity of B relative to A.
void ClosureDerivator::turn_with_a(const Side& a, const Vector3& spin, Motions& m) {
  const Vector3& omega = a.moving.V.angular;
  m.c -= omega.cross(spin);
  for (int s = 0; s < size; ++s) {
    const Vector3 e = carried_.col(s), domega = omega_.col(s), dspin = spin_.col(s);
    const Vector3 own = jacobian.col(s);
    curvature_.col(s) -= domega.cross(spin) + omega.cross(dspin) + e.cross(m.c);
    curvature_v_.col(s) -= e.cross(spin) + omega.cross(own);
    error_.col(s) -= e.cross(m.e);
    carried_.col(s).setZero();
  }
}

/// Drops the directions in which a pair has no rows.
void ClosureDerivator::keep_rows(const PairConstraint& pair, Motions& m) {
  if (pair.law.rows == 3) return;
  const auto axes = pair.frame.middleCols(pair.first % 3, pair.law.rows);
  const Matrix3 kept = axes * axes.transpose();
  for (Vector3* v : {&m.e, &m.c, &m.e_reached, &m.y}) *v = kept * *v;
  for (Columns* of :
       {&jacobian, &error_, &curvature_, &curvature_v_, &y_, &reached_q_, &reached_w_})
    for (int s = 0; s < size; ++s) of->col(s) = kept * Vector3(of->col(s));
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

/// Finds errors and their derivatives, in W and carried along with A.
ClosureDerivator::Motions ClosureDerivator::find_motions(const Model& model, double h,
                                                         const ActingClosure& acting,
                                                         const PairConstraint& pair,
                                                         const Kinematics& data, bool aimed) {
  const Closure& closure = model.closures()[acting.index];
  const bool turns = pair.first >= 3;
  const Side a = side(model, pair.body_a, -1.0, closure.X_AC, pair.position, data);
  const Side b = side(model, pair.body_b, 1.0, acting.X_BC, pair.position, data);
  const Error here = error(closure, acting.X_BC, pair, data);
  const Error there = aimed ? error(closure, acting.X_BC, pair, *reached_) : here;
  list(model, pair);
  const Vector3 spin = b.moving.W.angular - a.moving.W.angular;
  const double share_b = acts_at_b(closure) ? 1.0 : 0.5;
  for (const Side* s : {&a, &b}) {
    if (turns) {
      add_turns(model, *s, here);
    } else {
      add_points(model, *s, spin, s == &b ? share_b : 1.0 - share_b);
    }
    if (aimed) add_reached(model, *s, s == &a ? closure.X_AC : acting.X_BC, turns, there);
  }
  add_carrier(model, a);
  const Vector3 started = b.moving.V.angular - a.moving.V.angular;
  Motions m{here.apart,
            turns ? Vector3(b.moving.A.angular - a.moving.A.angular) : Vector3(b.a - a.a),
            there.apart, turns ? spin : Vector3(b.moving.W.at(b.place) - a.moving.W.at(a.place))};
  Vector3 u = b.u - a.u;
  if (pair.error == ClosureError::kAxis) {
    add_axis(model, b, here.apart);
    u = b.moving.V.angular.cross(here.apart);
    m.c = b.moving.A.angular.cross(here.apart) + b.moving.V.angular.cross(u);
  }
  if (pair.error == ClosureError::kDistance) {
    take_distance(closure, pair, h, u, m);
  } else if (pair.error == ClosureError::kTurn && pair.soft) {
    turn_with_a(a, started, m);
  } else if (follows_a(pair)) {
    see_from_a(pair, a, u, here, there, m);
  }
  if (follows_a(pair)) keep_rows(pair, m);
  return m;
}

void ClosureDerivator::compute(const Model& model, const ContactOptions& options, double h,
                               const ActingClosure& acting, const PairConstraint& pair,
                               const Kinematics& data, bool aimed) {
  const Closure& closure = model.closures()[acting.index];
  const auto [e, c, e_reached, y] = find_motions(model, h, acting, pair, data, aimed);
  const double counted = error_share(closure, pair, h);
  Matrix3 recovered;
  if (closure.rope && e[0] > 0.0) {  // slack
    recovered = Matrix3::Identity() / h;
    bias = e / h;
  } else if (pair.soft) {
    recovered = counted / h * Matrix3::Identity();
    bias = counted / h * e;
  } else {
    recovered = recovery(options, h, e, bias);
  }
  double speed = 0.0;
  const int body = aimed ? fastest(model, pair, speed) : 0;
  const double share = aimed ? share_aimed(h * speed) : 0.0;
  const Vector3 by_curvature = 0.5 * counted * h * c, by_aim = (e_reached - e) / h - y;
  bias += (1.0 - share) * by_curvature;
  if (aimed) bias += share * by_aim;
  const double rest = 0.5 * counted * h * (1.0 - share);
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
  if (!follows_a(pair)) return;
  const Vector3 in_world = bias;
  bias.setZero();
  for (int i = 0; i < pair.law.rows; ++i)
    bias[i] = pair.frame.col((pair.first + i) % 3).dot(in_world);
}

void ClosureDerivator::add_to(MatrixX& out, double scale, const Columns& slopes) const {
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i)
      out(coordinates[i], coordinates[j]) += scale * jacobian.col(i).dot(slopes.col(j));
}

ContactMotion closure_motion(const Model& model, const ActingClosure& acting,
                             const PairConstraint& pair, const Kinematics& data) {
  const Closure& closure = model.closures()[acting.index];
  const Vector3 to_b = data.X_WB[closure.body_b] * acting.X_BC.translation - pair.position;
  Eigen::Matrix<double, 3, 6> anchor;
  anchor << -skew(to_b), Matrix3::Identity();
  ContactMotion motion;
  motion.point = (acts_at_b(closure) ? 1.0 : 0.5) * anchor;
  motion.normal.setZero();
  motion.gap.setZero();
  const double d = 2.0 * to_b.norm();  // the place is halfway between the anchors
  if (closure.type == ClosureType::kDistance && d > kNoDirection) {
    const Vector3& n = pair.frame.col(0);
    motion.normal = (anchor - n * (n.transpose() * anchor)) * ((closure.rope ? -1.0 : 1.0) / d);
  }
  return motion;
}

}  // namespace counterpoint
