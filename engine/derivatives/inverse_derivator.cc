#include "counterpoint/engine/derivatives/inverse_derivator.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/assemble.h"
#include "counterpoint/engine/contact_law.h"
#include "counterpoint/engine/derivatives/joint_derivatives.h"
#include "counterpoint/engine/kinematics.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint {
namespace {

/// Of a force that a body carries at a point: `next` and the rest as PairResponse of B against a
/// world that stays.
PairResponse body_force(const Force& force) {
  PairResponse out;
  out.wrench = force;
  out.next.setZero();
  out.v_a.setZero();
  out.v_b.setZero();
  out.still.setZero();
  // The point goes with the body, the force keeps its axes.
  out.still.topRightCorner<3, 3>() = -skew(force.force);
  return out;
}

Vector3 direction(const Vector3& v) {
  const double size = v.norm();
  return size > 0.0 ? Vector3(v / size) : Vector3(Vector3::Zero());
}

/// -(c1 + c2 |v|) v+ at the centre of a link, and the torque alike; v, v+ there (drag.h).
PairResponse drag_response(const Drag& drag, const Motion& V, const Motion& V_next) {
  const double mass = drag.linear + drag.quadratic * V.linear.norm();
  const double about = drag.angular + drag.angular_quadratic * V.angular.norm();
  PairResponse out = body_force({-about * V_next.angular, -mass * V_next.linear});
  out.next.topLeftCorner<3, 3>() = -about * Matrix3::Identity();
  out.next.bottomRightCorner<3, 3>() = -mass * Matrix3::Identity();
  const Matrix3 by_v = -drag.quadratic * V_next.linear * direction(V.linear).transpose();
  out.v_b.bottomRightCorner<3, 3>() = by_v;
  out.v_b.topLeftCorner<3, 3>() =
      -drag.angular_quadratic * V_next.angular * direction(V.angular).transpose();
  // At the point displaced velocities are others.
  out.still.bottomRightCorner<3, 3>() = -mass * skew(V_next.angular) + by_v * skew(V.angular);
  out.by_v = drag.quadratic > 0.0 || drag.angular_quadratic > 0.0;
  return out;
}

/// A contact so far off that neither its force nor what it changes by matters: 1e-9 of the weight
/// of what it moves, 1e-9 of that a metre.
bool is_nothing(const PairConstraint& pair, const PairBodies& bodies, double h,
                const InverseWeights& weights) {
  constexpr double kNothing = 1e-9 * kStandardGravity;  // [m/s^2, 1/s^2]
  const double alpha = weights.contact[pair.body_a] + weights.contact[pair.body_b];
  const double y =
      pair.law.bias[0] + pair.frame.col(0).dot(bodies.next_b.linear - bodies.next_a.linear);
  double closing = y;
  if (pair.law.rows > 1 && !pair.law.coulomb) {  // the convex cone's smaller eigenvalue
    Vector3 slip = pair.frame.transpose() * (bodies.next_b.linear - bodies.next_a.linear);
    closing -= pair.law.friction[0] * std::hypot(slip[1], slip[2]);
    if (pair.law.rows > 3) return false;
  }
  if (!(closing > 0.0)) return false;
  // f < k / y and G < k / y^2.
  const double f = pair.law.smoothing / closing;
  return alpha * f / h < kNothing && alpha * f / (closing * h * h) < kNothing;
}

void scale(BodyResponse& response, double by) {
  response.q *= by;
  response.next *= by;
  response.v *= by;
}

}  // namespace

InverseDerivator::InverseDerivator(const Model& model)
    : sweep_(model),
      velocity_terms_(model),
      load_(model.num_bodies()),
      response_(model.num_bodies()),
      responds_(model.num_bodies(), 0),
      v_(VectorX::Zero(model.nv())),
      acceleration_(VectorX::Zero(model.nv())) {}

void InverseDerivator::begin(const Model& model) {
  for (int i = 0; i < model.num_bodies(); ++i) {
    load_[i] = Force();
    responds_[i] = 0;
  }
  couplings_.clear();
  inner_.clear();
  motions_.begin();
  by_v_ = false;
}

/// `force` on a body at a place in W, with the response of minus it, both there.
void InverseDerivator::add_force(const Model& model, int body, const Vector3& place,
                                 const Force& force, BodyResponse response, const Data& data) {
  const Tree& tree = model.trees()[model.body(body).tree];
  load_[body] += shift(force, place - data.X_WB[body].translation);
  response.move(place - TreeSweep::reference(tree, data));
  if (responds_[body]) {
    response_[body] += response;
  } else {
    response_[body] = response;
    responds_[body] = 1;
  }
}

void InverseDerivator::add_wrenches(const Model& model, const Input& known, const Data& data) {
  for (const ExternalWrench& w : known.wrenches) {
    if (w.body == 0) continue;
    BodyResponse response = body_force(w.wrench).of_b(Motion(), Motion());
    scale(response, -1.0);
    add_force(model, w.body, data.X_WB[w.body] * w.point, w.wrench, response, data);
  }
}

void InverseDerivator::add_drag(const Model& model, const std::vector<Motion>& V_next,
                                const Data& data) {
  for (const BodyDrag& link : model.drags()) {
    const Vector3 arm = data.X_WB[link.body].rotation * link.center;
    const Motion V = shift(data.V[link.body], arm), next = shift(V_next[link.body], arm);
    const PairResponse drag = drag_response(link.drag, V, next);
    by_v_ = by_v_ || drag.by_v;
    BodyResponse response = drag.of_b(next, V);
    scale(response, -1.0);
    add_force(model, link.body, data.X_WB[link.body].translation + arm, drag.wrench, response,
              data);
  }
}

bool InverseDerivator::contact_response(const Model& model, const SimulationOptions& options,
                                        EffectSet effects, size_t contact, const PairBodies& bodies,
                                        Workspace::Impl& ws, PairResponse& out) {
  const double h = options.time_step;
  const PairConstraint& pair = ws.constraints.pairs[contact];
  const collision::Candidate& candidate = ws.constraints.contacts[contact];
  const InverseWeights& weights = ws.finder.weights();
  const double alpha = weights.contact[pair.body_a] + weights.contact[pair.body_b];
  const double towards_b = weights.contact[pair.body_b] / alpha - 0.5;
  ContactMotion motion;
  if (!motions_.find(model, ws.data, candidate, towards_b, motion)) {
    find_velocity_response(pair, bodies, out);
    return false;
  }
  Material surface = combine_materials(model.geometries()[candidate.geometry_a].material,
                                       model.geometries()[candidate.geometry_b].material);
  if (!effects.has(Effect::kFriction)) surface.friction = 0.0;
  if (!effects.has(Effect::kRestitution)) surface.restitution = 0.0;
  double gap = candidate.gap;
  bool turning = false, closed = false;
  if (gap > 0.0) {
    const double closer = turning_advance(pair, bodies, h);
    turning = closer > 0.0;
    gap = std::max(gap - std::max(closer, 0.0), 0.0);
    closed = !(gap > 0.0);
  }
  const Vector3 v = pair.frame.transpose() * (bodies.start_b.linear - bodies.start_a.linear);
  LawSlopes slopes = contact_law_slopes(law_options(options, alpha, weights.total_mass), h, surface,
                                        alpha, gap, v);
  if (pair.law.type != contact::LawType::kFrictionCone) slopes.v[1] = slopes.v[2] = 0.0;
  if (closed) slopes.gap = slopes.smoothing = 0.0;
  find_contact_response(pair, bodies, motion, slopes, turning && !closed, h, out);
  return true;
}

void InverseDerivator::couple(const Model& model, const PairConstraint& pair, int body, int by,
                              BodyResponse response, const Data& data) {
  const auto arm = [&](int b) -> Vector3 {
    return pair.position - TreeSweep::reference(model.trees()[model.body(b).tree], data);
  };
  const Matrix3 rows = skew(arm(body)), columns = skew(arm(by));
  for (Matrix6* K : {&response.q, &response.next, &response.v}) {
    K->leftCols<3>() -= K->rightCols<3>() * columns;
    K->topRows<3>() += rows * K->bottomRows<3>();
  }
  // Contacts of two bodies come one after the other.
  for (size_t i = couplings_.size(); i-- > 0 && i + 2 >= couplings_.size();) {
    if (couplings_[i].body != body || couplings_[i].by != by) continue;
    couplings_[i].response += response;
    return;
  }
  couplings_.push_back({body, by, response});
}

/// Between two bodies of one tree.
void InverseDerivator::add_inner(const Model& model, const PairConstraint& pair,
                                 const PairBodies& bodies, const PairResponse& response, double h,
                                 const Data& data) {
  const Tree& tree = model.trees()[model.body(pair.body_a).tree];
  const Matrix3 arm = skew(pair.position - TreeSweep::reference(tree, data));
  InnerPair inner{pair.body_a,
                  pair.body_b,
                  response.by_v,
                  response.displaced(bodies.next_b, bodies.start_b),
                  carried(response.wrench),
                  response.next,
                  response.v_a,
                  response.v_b};
  for (Matrix6* K : {&inner.displaced, &inner.carried, &inner.next, &inner.v_a, &inner.v_b}) {
    K->leftCols<3>() -= K->rightCols<3>() * arm;
    K->topRows<3>() += arm * K->bottomRows<3>();
    *K *= 1.0 / h;
  }
  if (!inner_.empty() && inner_.back().body_a == inner.body_a &&
      inner_.back().body_b == inner.body_b) {
    inner_.back() += inner;
  } else {
    inner_.push_back(inner);
  }
}

void InverseDerivator::add_pair(const Model& model, const PairConstraint& pair,
                                const PairBodies& bodies, const PairResponse& response, double h,
                                const Data& data) {
  by_v_ = by_v_ || response.by_v;
  if (pair.body_a != 0 && pair.body_b != 0 &&
      model.body(pair.body_a).tree == model.body(pair.body_b).tree)
    return add_inner(model, pair, bodies, response, h, data);
  const Motion &next = bodies.next_b, &start = bodies.start_b;
  const auto scaled = [&](BodyResponse r) {
    scale(r, -1.0 / h);
    return r;
  };
  if (pair.body_b != 0)
    add_force(model, pair.body_b, pair.position, response.wrench * (1.0 / h),
              scaled(response.of_b(next, start)), data);
  if (pair.body_a == 0) return;
  add_force(model, pair.body_a, pair.position, response.wrench * (-1.0 / h),
            scaled(response.of_a(next, start)), data);
  if (pair.body_b == 0) return;
  couple(model, pair, pair.body_b, pair.body_a, scaled(response.of_b_by_a(next, start)), data);
  couple(model, pair, pair.body_a, pair.body_b, scaled(response.of_a_by_b(next, start)), data);
}

bool InverseDerivator::add_contacts(const Model& model, const SimulationOptions& options,
                                    EffectSet effects, Workspace::Impl& ws) {
  bool known = true;
  PairResponse response;
  for (size_t i = 0; i < ws.constraints.pairs.size(); ++i) {
    const PairConstraint& pair = ws.constraints.pairs[i];
    const PairBodies bodies = pair_bodies(pair, ws.data, ws.velocity);
    if (i < ws.constraints.contacts.size()) {
      if (is_nothing(pair, bodies, options.time_step, ws.finder.weights())) continue;
      known = contact_response(model, options, effects, i, bodies, ws, response) && known;
    } else {
      find_velocity_response(pair, bodies, response);
      known = false;
    }
    add_pair(model, pair, bodies, response, options.time_step, ws.data);
  }
  return known;
}

/// The motion that inertial and velocity-dependent forces are taken at, but for what
/// velocity_terms.h says; of bodies that fly these forces are a load.
void InverseDerivator::set_velocities(const Model& model, const VectorRef& v,
                                      const VectorRef& v_next, double h,
                                      const Workspace::Impl& ws) {
  acceleration_ = (v_next - v) / h;
  v_ = v;
  if (!ws.data.has_coriolis) v_.setZero();
  for (int n = 0; ws.data.has_coriolis && n < ws.free_flight.num_flyers(); ++n) {
    const int i = ws.free_flight.body(n);
    v_.segment(model.body(i).v_index, joint_nv(model.body(i).joint_type)).setZero();
    load_[i] -= ws.data.mean_force[i];
  }
}

bool InverseDerivator::sweep_trees(const Model& model, EffectSet effects, double h,
                                   const VectorRef& q, const VectorRef& v, const VectorRef& v_next,
                                   Workspace::Impl& ws, InverseDerivatives& d) {
  SweepInput in;
  in.v = v_.data();
  in.a = acceleration_.data();
  in.gravity = effects.has(Effect::kGravity) ? model.gravity() : Vector3(Vector3::Zero());
  in.load = load_.data();
  in.response = response_.data();
  in.responds = responds_.data();
  in.responds_to_v = by_v_;
  in.v_start = v.data();
  in.v_next = v_next.data();
  in.mass_in_next = 1.0 / h;
  in.mass_in_v = -1.0 / h;
  const SweepOutput out{d.dq, d.dv, d.dv_next};
  bool known = true;
  for (int t = 0; t < model.num_trees(); ++t) {
    known = velocity_terms_.prepare(model, t, effects, h, q, v, ws, v_, acceleration_, in) && known;
    sweep_.run(model, model.trees()[t], ws.data, in, out);
    velocity_terms_.add(model, t, effects, h, q, v, ws, d);
  }
  if (!couplings_.empty() || !inner_.empty())
    for (const Tree& tree : model.trees()) sweep_.find_response_columns(model, tree, in);
  for (const InnerPair& pair : inner_) sweep_.add_inner_pair(model, pair, out);
  for (const Coupling& c : couplings_) sweep_.add_coupling(model, c.body, c.by, c.response, out);
  if (ws.data.has_coriolis) add_flyers(model, h, v, in.gravity, ws, d);
  return known;
}

/// What the mean forces of bodies that fly change by beyond being carried along: with their angular
/// velocity, and with gravity as a top sees it. By differences of these alone, extrapolated.
void InverseDerivator::add_flyers(const Model& model, double h, const VectorRef& v,
                                  const Vector3& gravity, const Workspace::Impl& ws,
                                  InverseDerivatives& d) const {
  for (int n = 0; n < ws.free_flight.num_flyers(); ++n) {
    const int i = ws.free_flight.body(n);
    const Body& body = model.body(i);
    const int linear = joint_num_linear(body.joint_type), k = body.v_index + linear;
    const Matrix3& R = ws.data.X_WB[i].rotation;
    const Vector3 omega = v.segment<3>(k), g = R.transpose() * gravity;
    // Rows of the joint: linear along its frame's axes, angular about the body's.
    const auto force = [&](const Vector3& w, const Vector3& down) {
      const Force f = ws.free_flight.mean_force(model, n, h, w, down);
      Vector6 out;
      out << (linear > 0 ? Vector3(body.X_PJ.rotation.transpose() * (R * f.force))
                         : Vector3(Vector3::Zero())),
          f.torque;
      return out;
    };
    const auto slope = [&](const Vector3& dw, const Vector3& dg, double s) -> Vector6 {
      return (force(omega + s * dw, g + s * dg) - force(omega - s * dw, g - s * dg)) / (2.0 * s);
    };
    const double step = 1e-3 * std::min(1.0 / h, 1.0 + omega.norm());
    for (int j = 0; j < 3; ++j) {
      const Vector3 unit = Vector3::Unit(j), none = Vector3::Zero();
      const Vector6 by_v = (4.0 * slope(unit, none, step) - slope(unit, none, 2.0 * step)) / 3.0;
      d.dv.block(body.v_index, k + j, linear + 3, 1) += by_v.tail(linear + 3);
      if (linear > 0 || gravity.isZero(0.0)) continue;
      const Vector3 turned = g.cross(unit);
      const Vector6 by_q = (4.0 * slope(none, turned, 1e-2) - slope(none, turned, 2e-2)) / 3.0;
      d.dq.block<3, 1>(k, k + j) += by_q.tail<3>();
    }
  }
}

bool InverseDerivator::compute(const Model& model, const SimulationOptions& options,
                               EffectSet effects, const VectorRef& q, const VectorRef& v,
                               const VectorRef& v_next, const Input& known, Workspace::Impl& ws,
                               InverseDerivatives& d) {
  const double h = options.time_step;
  const int nv = model.nv();
  for (MatrixX* m : {&d.dq, &d.dv, &d.dv_next}) {
    if (m->rows() != nv || m->cols() != nv) m->resize(nv, nv);
    if (model.num_trees() != 1) m->setZero();
  }
  compute_inertias(model, ws.data);
  begin(model);
  set_velocities(model, v, v_next, h, ws);
  if (effects.has(Effect::kExternalWrenches)) add_wrenches(model, known, ws.data);
  if (effects.has(Effect::kDrag)) add_drag(model, ws.velocity, ws.data);
  bool closed = add_contacts(model, options, effects, ws);
  closed = sweep_trees(model, effects, h, q, v, v_next, ws, d) && closed;
  add_joint_force_derivatives(model, effects, h, d);
  add_joint_row_derivatives(model, options, ws.constraints.joints, q, v_next, ws.finder.weights(),
                            d);
  for (const JointConstraint& row : ws.constraints.joints)
    closed = closed && row.law.type != contact::LawType::kEquality;
  return closed;
}

}  // namespace counterpoint
