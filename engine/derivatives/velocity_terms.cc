#include "counterpoint/engine/derivatives/velocity_terms.h"

#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/derivatives/right_jacobian.h"
#include "counterpoint/engine/integrator.h"
#include "counterpoint/engine/joint_forces.h"
#include "counterpoint/engine/kinematics.h"
#include "counterpoint/engine/step_forces.h"

namespace counterpoint {
namespace {

bool is_linkage(const Tree& tree) { return tree.body_end - tree.body_begin > 1; }

/// x' Q and x' P of configuration_difference's chain at q (+) turn: the identity but for
/// quaternions, where Q is the right Jacobian, P = exp(-turn). Row vectors, as columns.
template <bool right>
void chain(const Model& model, const Tree& tree, const VectorX& turn, Eigen::Ref<VectorX> x) {
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kSpherical && body.joint_type != JointType::kFloating)
      continue;
    const int k = body.v_index + joint_num_linear(body.joint_type), j = k - tree.v_begin;
    const Vector3 r = turn.segment<3>(k);
    const Matrix3 map = right ? right_jacobian(r) : quaternion_exp(-r).toRotationMatrix();
    x.segment<3>(j) = (map.transpose() * x.segment<3>(j)).eval();
  }
}

}  // namespace

VelocityTerms::VelocityTerms(const Model& model)
    : sweep_(model),
      kind_(model.num_trees(), Kind::kPlain),
      zero_(VectorX::Zero(model.nv())),
      other_(zero_),
      f_(zero_),
      a_f_(zero_),
      half_(zero_),
      start_(model),
      end_(model),
      q_reached_(model.default_q()),
      moved_(zero_),
      share_q_(zero_),
      share_v_(zero_) {
  bool any = false;
  for (const Tree& tree : model.trees()) any = any || is_linkage(tree);
  if (!any) return;
  const int nv = model.nv();
  for (MatrixX* m : {&dq_, &dv_, &da_, &factor_, &solved_}) m->setZero(nv, nv);
  for (MatrixX* m : {&rows_, &by_q_, &by_v_}) m->setZero(nv, 4);
  reached_.emplace(model);
}

bool VelocityTerms::prepare(const Model& model, int t, EffectSet effects, double h,
                            const VectorRef& q, const VectorRef& v, Workspace::Impl& ws,
                            VectorX& v_at, VectorX& a_at, SweepInput& in) {
  const Tree& tree = model.trees()[t];
  kind_[t] = Kind::kPlain;
  in.velocity_factor = 1.0;
  if (!ws.data.has_coriolis || !is_linkage(tree)) return true;
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  const bool covered = ws.forecast.covers(t);
  const double share = ws.fast_trees.share(t);
  if (covered) f_(part) = ws.forecast.velocity()(part);
  if (share > 0.0) {
    a_at(part) -= ws.fast_trees.change()(part) / h;
    if (covered) {
      // Else the energy has a part by the work of these forces.
      if (!turns_far(model, tree, h, ws.fast_trees.scale(t), q, v, ws)) return false;
      kind_[t] = Kind::kBoth;
      other_(part) = f_(part) - share * (v(part) + ws.fast_trees.plain_change()(part));
      v_at(part) = 0.5 * (v(part) + other_(part));
      return true;
    }
    kind_[t] = Kind::kProjected;
    in.velocity_factor = std::sqrt(1.0 - share);
    v_at(part) *= in.velocity_factor;
    return true;
  }
  if (!covered && !(ws.forecast.knows(t) && v(part).isZero(0.0) &&
                    forecast_at_rest(model, tree, effects, h, q, v, ws)))
    return true;
  kind_[t] = Kind::kForecast;
  other_(part) = f_(part);
  v_at(part) = 0.5 * (v(part) + f_(part));
  return true;
}

/// Whether the tree's fastest body turns by more than FastTrees::kFarTurn within the step, at its
/// start and with the velocity that keeps the energy at its end.
bool VelocityTerms::turns_far(const Model& model, const Tree& tree, double h, double scale,
                              const VectorRef& q, const VectorRef& v, const Workspace::Impl& ws) {
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  moved_(part) = scale * (v(part) + ws.fast_trees.plain_change()(part));
  integrate_configuration(model, q, moved_, h, bodies, q_reached_);
  compute_poses(model, q_reached_, bodies, *reached_);
  compute_velocities(model, moved_, bodies, *reached_);
  double start = 0.0, end = 0.0;
  for (int i = bodies.begin; i < bodies.end; ++i) {
    start = std::max(start, ws.data.V[i].angular.norm());
    end = std::max(end, reached_->V[i].angular.norm());
  }
  return h * std::min(start, end) > FastTrees::kFarTurn;
}

/// f_ of a tree at rest, for which the engine makes no forecast: velocity-dependent forces vanish
/// there, but not what they change by.
bool VelocityTerms::forecast_at_rest(const Model& model, const Tree& tree, EffectSet effects,
                                     double h, const VectorRef& q, const VectorRef& v,
                                     Workspace::Impl& ws) {
  ws.tau.setZero();
  ws.diagonal.setZero();
  EffectCounts not_counted;
  add_joint_forces(model, effects, h, q, v, ws.diagonal, ws.tau, not_counted);
  const bool had_external = std::exchange(ws.data.has_external, false);
  const Vector3 gravity =
      effects.has(Effect::kGravity) ? model.gravity() : Vector3(Vector3::Zero());
  added_.swap(ws.data.added);
  const bool regular = aba(model, ws.tau, ws.diagonal, gravity, {tree.body_begin, tree.body_end},
                           ws.data, ws.acceleration);
  added_.swap(ws.data.added);
  ws.data.has_external = had_external;
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  if (regular) f_(part) = v(part) + h * ws.acceleration(part);
  return regular;
}

void VelocityTerms::add(const Model& model, int t, EffectSet effects, double h, const VectorRef& q,
                        const VectorRef& v, Workspace::Impl& ws, InverseDerivatives& d) {
  const Tree& tree = model.trees()[t];
  const Kind kind = kind_[t];
  if (kind == Kind::kForecast || kind == Kind::kBoth)
    add_forecast(model, tree, effects, h, v, ws, d);
  if (kind == Kind::kProjected || kind == Kind::kBoth)
    add_projected(model, t, effects, h, q, v, ws, d);
}

void VelocityTerms::add_forecast(const Model& model, const Tree& tree, EffectSet effects, double h,
                                 const VectorRef& v, Workspace::Impl& ws, InverseDerivatives& d) {
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const auto part = Eigen::seqN(begin, n);
  SweepInput in;
  half_(part) = 0.5 * (v(part) - other_(part));
  in.v = half_.data();
  in.a = zero_.data();
  sweep_.run(model, tree, ws.data, in, {dq_, dv_, da_});
  d.dq.block(begin, begin, n, n) -= dq_.block(begin, begin, n, n);
  a_f_(part) = (f_(part) - v(part)) / h;
  in.v = v.data();
  in.a = a_f_.data();
  if (effects.has(Effect::kGravity)) in.gravity = model.gravity();
  sweep_.run(model, tree, ws.data, in, {dq_, dv_, da_});
  auto D = factor_.topLeftCorner(n, n), X = solved_.topLeftCorner(n, n);
  // B(v, .) = half of dn/dv; X' = h inv(M + D) B(v, .)'.
  D = da_.block(begin, begin, n, n);
  X = 0.5 * h * dv_.block(begin, begin, n, n).transpose();
  // The rest of the forecast's equation: rotors, dampers, springs.
  if (effects.has(Effect::kArmature)) D.diagonal() += model.armature().segment(begin, n);
  if (effects.has(Effect::kDamping)) {
    D.diagonal() += h * model.damping().segment(begin, n);
    dv_.diagonal().segment(begin, n) += model.damping().segment(begin, n);
  }
  if (effects.has(Effect::kSprings)) {
    for (const JointSpring& spring : model.springs()) {
      const int k = model.body(spring.joint + 1).v_index;
      if (k < begin || k >= begin + n) continue;
      D(k - begin, k - begin) += h * h * spring.stiffness;
      dq_(k, k) += spring.stiffness;
      dv_(k, k) += h * spring.stiffness;
    }
  }
  solver_.begin(D, n);
  solver_.add(X, 0, 1.0);
  if (!solver_.solve()) return;
  solver_.get(0, X);
  d.dq.block(begin, begin, n, n) -= X.transpose().lazyProduct(dq_.block(begin, begin, n, n));
  d.dv.block(begin, begin, n, n) -= X.transpose().lazyProduct(dv_.block(begin, begin, n, n));
}

/// share_q_, share_v_: of the share, by the angular velocity of the body that turns fastest.
void VelocityTerms::find_share_gradient(const Model& model, const Tree& tree, double h,
                                        bool foreseen, const Data& data) {
  const int n = tree.v_end - tree.v_begin;
  share_q_.head(n).setZero();
  share_v_.head(n).setZero();
  int fastest = tree.body_begin;
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    if (data.V[i].angular.squaredNorm() > data.V[fastest].angular.squaredNorm()) fastest = i;
  const Vector3 omega = data.V[fastest].angular;
  const double part = h / (foreseen ? FastTrees::kForeseen : 1.0);
  const double slope = FastTrees::share_slope(part * omega.squaredNorm()) * 2.0 * part;
  for (int i = fastest; i != 0; i = model.body(i).parent) {
    const Body& body = model.body(i);
    const Vector3 carrier = body.parent != 0 ? data.V[body.parent].angular : Vector3::Zero();
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
      const Vector3& e = data.axis[k].angular;
      share_v_[k - tree.v_begin] = slope * omega.dot(e);
      share_q_[k - tree.v_begin] = slope * omega.dot(carrier.cross(e));
    }
  }
}

/// by_q_, by_v_: first column of the scale, without what goes through the change by the forces
/// (the rows by which that counts are left in rows_); then of the momentum that the centre of mass
/// lacks, likewise, at that scale.
void VelocityTerms::find_scale_gradient(const Model& model, const Tree& tree, double h,
                                        double scale, const VectorRef& q, const VectorRef& v,
                                        const VectorX& rotors, const Data& data) {
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  // moved_: scale times w, then that turned by h.
  integrate_configuration(model, q, moved_, h, bodies, q_reached_);
  compute_poses(model, q_reached_, bodies, *reached_);
  compute_inertias(model, bodies, *reached_);
  end_.compute(model, tree, *reached_, moved_.data(), rotors);
  start_.compute(model, tree, data, v.data(), rotors);
  moved_.segment(begin, n) *= h;
  const int columns = end_.floats ? 4 : 1;
  for (int c = 0; c < columns; ++c) {
    auto row = rows_.col(c).head(n);
    auto by_q = by_q_.col(c).head(n);
    if (c == 0) {
      by_q = end_.dq.head(n);
    } else {
      by_q = end_.momentum_dq.row(c - 1).head(n).transpose();
    }
    row = by_q;
    chain<true>(model, tree, moved_, row);
    chain<false>(model, tree, moved_, by_q);
    if (c == 0) {
      row = h * row + end_.dv.head(n);
      by_q = start_.dq.head(n) - by_q;
      by_v_.col(c).head(n) = start_.dv.head(n) - scale * row;
    } else {
      row = h * row + end_.momentum_dv.row(c - 1).head(n).transpose();
      by_q = start_.momentum_dq.row(c - 1).head(n).transpose() - by_q;
      by_v_.col(c).head(n) = start_.momentum_dv.row(c - 1).head(n).transpose() - scale * row;
    }
  }
}

void VelocityTerms::add_projected(const Model& model, int t, EffectSet effects, double h,
                                  const VectorRef& q, const VectorRef& v, Workspace::Impl& ws,
                                  InverseDerivatives& d) {
  const Tree& tree = model.trees()[t];
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const auto part = Eigen::seqN(begin, n);
  const double share = ws.fast_trees.share(t), scale = ws.fast_trees.scale(t);
  const VectorX& plain = ws.fast_trees.plain_change();
  const VectorX& rotors = rotor_inertia(model, effects, ws);
  a_f_(part) = plain(part) / h;
  SweepInput in;
  in.v = v.data();
  in.a = a_f_.data();
  sweep_.run(model, tree, ws.data, in, {dq_, dv_, da_});
  auto M = da_.block(begin, begin, n, n);
  const auto dyn_q = dq_.block(begin, begin, n, n), dyn_v = dv_.block(begin, begin, n, n);
  auto out_q = d.dq.block(begin, begin, n, n), out_v = d.dv.block(begin, begin, n, n);
  M.diagonal() += rotors(part);

  // w = (M + R) (v + plain), changed = (M + R) (r - v) / h and the velocity-dependent force that
  // the share takes away: what scale and share multiply.
  moved_(part) = v(part) + plain(part);
  auto w = half_.segment(begin, n);
  w.noalias() = M * moved_.segment(begin, n);
  auto changed = f_.segment(begin, n);
  if (kind_[t] == Kind::kBoth) {
    changed.noalias() = 0.5 * (dyn_v * moved_.segment(begin, n));
    other_(part) = ws.fast_trees.change()(part) / share;
  } else {
    changed.setZero();
    other_(part) = ws.fast_trees.change()(part) / share - plain(part);
  }
  changed.noalias() += (1.0 / h) * M * other_.segment(begin, n);
  other_(part) = moved_(part);
  moved_(part) *= scale;
  find_scale_gradient(model, tree, h, scale, q, v, rotors, ws.data);
  find_share_gradient(model, tree, h, kind_[t] == Kind::kBoth, ws.data);

  const int columns = end_.floats ? 4 : 1;
  // How fast each grows with the scale: rows (v + plain).
  Eigen::Matrix<double, 4, 1> grows = Eigen::Matrix<double, 4, 1>::Zero();
  for (int c = 0; c < columns; ++c) grows[c] = rows_.col(c).head(n).dot(other_.segment(begin, n));
  if (!solve_rows(M, dyn_v, columns, kind_[t] == Kind::kBoth)) return;
  if (kind_[t] == Kind::kBoth) {
    const auto Y = solved_.topLeftCorner(n, n);
    out_q += (share * h) * Y.transpose().lazyProduct(dyn_q);
    out_v += (share * h) * Y.transpose().lazyProduct(dyn_v) - (0.5 * share) * dyn_v;
  }
  close_gradients(dyn_q, dyn_v, columns, h * scale, grows);
  const double by_scale = -share / h;
  out_q += (share * scale) * dyn_q;
  out_v += (share * scale) * dyn_v + (share * (1.0 - scale) / h) * M;
  const auto add = [n](auto& out, double by, const auto& column, const auto& row) {
    out += by * column.lazyProduct(row.head(n).transpose());
  };
  add(out_q, by_scale, w, by_q_.col(0));
  add(out_v, by_scale, w, by_v_.col(0));
  add(out_q, -1.0, changed, share_q_);
  add(out_v, -1.0, changed, share_v_);
  // The base's axes are those of its frame.
  const Matrix3 to_axes = model.body(tree.body_begin).X_PJ.rotation.transpose();
  for (int c = 1; c < columns; ++c) {
    other_.segment(begin, n).noalias() = M.leftCols(3) * to_axes.col(c - 1);
    add(out_q, by_scale / end_.mass, other_.segment(begin, n), by_q_.col(c));
    add(out_v, by_scale / end_.mass, other_.segment(begin, n), by_v_.col(c));
  }
}

/// inv(M) of the rows' transposes, in their place, and with `both` of half of dn/dv', into solved_.
bool VelocityTerms::solve_rows(const Eigen::Ref<const MatrixX>& M,
                               const Eigen::Ref<const MatrixX>& dyn_v, int columns, bool both) {
  const auto n = M.rows();
  auto Y = solved_.topLeftCorner(n, n);
  solver_.begin(M, columns + (both ? static_cast<int>(n) : 0));
  solver_.add(rows_.topLeftCorner(n, columns), 0, 1.0);
  if (both) {
    Y = dyn_v.transpose();
    solver_.add(Y, columns, 0.5);
  }
  if (!solver_.solve()) return false;
  solver_.get(0, rows_.topLeftCorner(n, columns));
  if (both) solver_.get(columns, Y);
  return true;
}

/// Adds to by_q_ and by_v_ what goes through the change by the forces, `by` times; then the scale's
/// part of the momentum's.
void VelocityTerms::close_gradients(const Eigen::Ref<const MatrixX>& dyn_q,
                                    const Eigen::Ref<const MatrixX>& dyn_v, int columns, double by,
                                    const Eigen::Matrix<double, 4, 1>& grows) {
  const auto n = dyn_q.rows();
  const double inverse = std::abs(grows[0]) > 0.0 ? 1.0 / grows[0] : 0.0;
  for (int c = 0; c < columns; ++c) {
    auto q = by_q_.col(c).head(n), v = by_v_.col(c).head(n);
    q += by * dyn_q.transpose().lazyProduct(rows_.col(c).head(n));
    v += by * dyn_v.transpose().lazyProduct(rows_.col(c).head(n));
    if (c == 0) {
      q *= inverse;
      v *= inverse;
    } else {
      q -= grows[c] * by_q_.col(0).head(n);
      v -= grows[c] * by_v_.col(0).head(n);
    }
  }
}

}  // namespace counterpoint
