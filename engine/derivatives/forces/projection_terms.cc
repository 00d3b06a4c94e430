#include "counterpoint/engine/derivatives/forces/projection_terms.h"

#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
namespace {

/// Multiplies the row vector x', given as a column, by Q (right) or P of q (+) turn: identities
/// except for quaternion joints, where Q is the right Jacobian and P = exp(-turn).
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

ProjectionTerms::ProjectionTerms(const Model& model)
    : sweep_(model),
      zero_(VectorX::Zero(model.nv())),
      at_(zero_),
      a_(zero_),
      other_(zero_),
      half_(zero_),
      changed_(zero_),
      start_(model),
      end_(model),
      q_at_(model.default_q()),
      moved_(zero_),
      turned_(zero_),
      share_q_(zero_),
      share_v_(zero_) {
  const int nv = model.nv();
  bool any = false;
  for (const Tree& tree : model.trees()) any = any || tree.body_end - tree.body_begin > 1;
  if (!any) return;
  for (MatrixX* m : {&dq_, &dv_, &da_, &solved_}) m->setZero(nv, nv);
  for (MatrixX* m : {&start_.by_q, &start_.by_x, &end_.by_q, &end_.by_x, &by_q_, &by_v_})
    m->setZero(nv, 4);
  at_pose_.emplace(model);
}

int ProjectionTerms::fastest(const Tree& tree, const Kinematics& data) {
  int fastest = tree.body_begin;
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    if (data.V[i].angular.squaredNorm() > data.V[fastest].angular.squaredNorm()) fastest = i;
  return fastest;
}

/// Adds `by` times the gradient of |omega|^2 / 2, omega the angular velocity of a body.
void ProjectionTerms::add_turn_gradient(const Model& model, const Tree& tree, int body, double by,
                                        const Kinematics& data, VectorX& dq, VectorX& dv) {
  const Vector3 omega = data.V[body].angular;
  for (int i = body; i != 0; i = model.body(i).parent) {
    const int parent = model.body(i).parent, first = model.body(i).v_index;
    const Vector3 carrier = parent != 0 ? data.V[parent].angular : Vector3::Zero();
    for (int k = first; k < first + joint_nv(model.body(i).joint_type); ++k) {
      const Vector3& e = data.axis[k].angular;
      dv[k - tree.v_begin] += by * omega.dot(e);
      dq[k - tree.v_begin] += by * omega.dot(carrier.cross(e));
    }
  }
}

/// Finds share_q_, share_v_: gradient of the share through the angular velocity of the fastest
/// body.
void ProjectionTerms::find_share_gradient(const Model& model, const Tree& tree, double h,
                                          bool predicted, const Kinematics& data) {
  const int n = tree.v_end - tree.v_begin, body = fastest(tree, data);
  share_q_.head(n).setZero();
  share_v_.head(n).setZero();
  const double part = h / (predicted ? EnergyProjection::kPredictedFactor : 1.0);
  const double slope = EnergyProjection::share_slope(part * data.V[body].angular.squaredNorm());
  add_turn_gradient(model, tree, body, 2.0 * part * slope, data, share_q_, share_v_);
}

/// Finds the gradients for velocities x (nv), from the pose q (+) from h x: 0 the start, 1 the end.
void ProjectionTerms::find_gradients(const InverseArguments& of, const Tree& tree, double from,
                                     bool predicted, const VectorX& x, const VectorX& rotors,
                                     Gradients& out) {
  const Model& model = of.model;
  const double h = of.h();
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  const JointTurn turn = joint_turn(model, tree, h, x);
  const bool floats = model.body(tree.body_begin).joint_type == JointType::kFloating;
  const double along = from - EnergyProjection::lag(turn.angle, predicted, floats);
  const double slope = EnergyProjection::lag_slope(turn.angle, predicted, floats);
  integrate_configuration(model, of.q, x, along * h, bodies, q_at_);
  compute_poses(model, q_at_, bodies, *at_pose_);
  compute_inertias(model, bodies, *at_pose_);
  KineticGradient& at = out.at;
  at.compute(model, tree, *at_pose_, x.data(), rotors);
  turned_.segment(begin, n) = along * h * x.segment(begin, n);
  for (int c = 0; c < (at.floats ? 4 : 1); ++c) {
    auto row_q = out.by_q.col(c).head(n), row_x = out.by_x.col(c).head(n);
    if (c == 0) {
      row_q = at.dq.head(n);
    } else {
      row_q = at.momentum_dq.row(c - 1).head(n).transpose();
    }
    const double by_along = h * row_q.dot(x.segment(begin, n));
    row_x = row_q;
    chain<true>(model, tree, turned_, row_x);
    chain<false>(model, tree, turned_, row_q);
    row_x *= along * h;
    if (c == 0) {
      row_x += at.dv.head(n);
    } else {
      row_x += at.momentum_dv.row(c - 1).head(n).transpose();
    }
    if (slope == 0.0) continue;
    const auto fastest = Eigen::seqN(turn.first - begin, turn.count);
    row_x(fastest) -= (by_along * slope * h * h / turn.angle) * x.segment(turn.first, turn.count);
  }
}

/// Finds by_q_, by_v_. First column: gradient of the scale, without the part through the change of
/// velocity by the forces (end_.by_x keeps the rows for that part). Other columns: the same for the
/// linear momentum that is missing at that scale. moved_: scale (v + plain change).
void ProjectionTerms::find_scale_gradient(const InverseArguments& of, const Tree& tree,
                                          double scale, bool predicted, const VectorX& rotors) {
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  at_.segment(begin, n) = of.v.segment(begin, n);
  find_gradients(of, tree, 0.0, predicted, at_, rotors, start_);
  find_gradients(of, tree, 1.0, predicted, moved_, rotors, end_);
  const int columns = end_.at.floats ? 4 : 1;
  const auto part = [&](auto& matrix) { return matrix.topLeftCorner(n, columns); };
  part(by_q_) = part(start_.by_q) - part(end_.by_q);
  part(by_v_) = part(start_.by_x) - scale * part(end_.by_x);
}

// Long: one formula, whose terms share their factors.
void ProjectionTerms::add(const InverseArguments& of, int t, bool predicted,
                          const InvertedStep& inverted, InverseDerivatives& d) {
  const Model& model = of.model;
  const EffectSet effects = of.effects;
  const VectorRef& v = of.v;
  const double h = of.h();
  const Tree& tree = model.trees()[t];
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const auto part = Eigen::seqN(begin, n);
  const double share = inverted.start.energy_projection().share(t),
               scale = inverted.start.energy_projection().scale(t);
  const VectorX& plain = inverted.start.energy_projection().plain_change();
  const VectorX& rotors = inverted.start.rotor_inertia(model, effects);
  a_(part) = plain(part) / h;
  SweepInput in;
  in.v = v.data();
  in.a = a_.data();
  sweep_.run(model, tree, inverted.at(), in, {dq_, dv_, da_});
  auto M = da_.block(begin, begin, n, n);
  const auto dyn_q = dq_.block(begin, begin, n, n), dyn_v = dv_.block(begin, begin, n, n);
  auto out_q = d.dq.block(begin, begin, n, n), out_v = d.dv.block(begin, begin, n, n);
  M.diagonal() += rotors(part);

  // Factors of d scale and d share: w = (M + R) (v + plain), and changed = (M + R) (r - v) / h plus
  // the velocity-dependent force that the share replaces.
  moved_(part) = v(part) + plain(part);
  auto w = half_.segment(begin, n);
  w.noalias() = M * moved_.segment(begin, n);
  auto changed = changed_.segment(begin, n);
  if (predicted) {
    changed.noalias() = 0.5 * (dyn_v * moved_.segment(begin, n));
    other_(part) = inverted.start.energy_projection().change()(part) / share;
  } else {
    changed.setZero();
    other_(part) = inverted.start.energy_projection().change()(part) / share - plain(part);
  }
  changed.noalias() += (1.0 / h) * M * other_.segment(begin, n);
  other_(part) = moved_(part);
  moved_(part) *= scale;
  find_scale_gradient(of, tree, scale, predicted, rotors);
  find_share_gradient(model, tree, h, predicted, inverted.at());

  const int columns = end_.at.floats ? 4 : 1;
  // Growth of energy and momentum with the scale: rows times (v + plain).
  Eigen::Matrix<double, 4, 1> grows = Eigen::Matrix<double, 4, 1>::Zero();
  for (int c = 0; c < columns; ++c)
    grows[c] = end_.by_x.col(c).head(n).dot(other_.segment(begin, n));
  if (!solve_rows(M, dyn_v, columns, predicted)) return;
  if (predicted) {
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
  // Linear coordinates of the base are along axes of its joint frame.
  const Matrix3 to_axes = model.body(tree.body_begin).X_PJ.rotation.transpose();
  for (int c = 1; c < columns; ++c) {
    other_.segment(begin, n).noalias() = M.leftCols(3) * to_axes.col(c - 1);
    add(out_q, by_scale / end_.at.mass, other_.segment(begin, n), by_q_.col(c));
    add(out_v, by_scale / end_.at.mass, other_.segment(begin, n), by_v_.col(c));
  }
}

/// Replaces the columns of end_.by_x by inv(M) times them; both: also sets
/// solved_ = inv(M) (dn/dv)' / 2.
bool ProjectionTerms::solve_rows(const Eigen::Ref<const MatrixX>& M,
                                 const Eigen::Ref<const MatrixX>& dyn_v, int columns, bool both) {
  const auto n = M.rows();
  auto Y = solved_.topLeftCorner(n, n);
  solver_.begin(M, columns + (both ? static_cast<int>(n) : 0));
  solver_.add(end_.by_x.topLeftCorner(n, columns), 0, 1.0);
  if (both) {
    Y = dyn_v.transpose();
    solver_.add(Y, columns, 0.5);
  }
  if (!solver_.solve()) return false;
  solver_.get(0, end_.by_x.topLeftCorner(n, columns));
  if (both) solver_.get(columns, Y);
  return true;
}

/// Adds `by` times the part through the change of velocity by the forces to by_q_ and by_v_.
/// Divides by the growth to get the scale's gradient, and takes its part off the momentum's.
void ProjectionTerms::close_gradients(const Eigen::Ref<const MatrixX>& dyn_q,
                                      const Eigen::Ref<const MatrixX>& dyn_v, int columns,
                                      double by, const Eigen::Matrix<double, 4, 1>& grows) {
  const auto n = dyn_q.rows();
  const double inverse = std::abs(grows[0]) > 0.0 ? 1.0 / grows[0] : 0.0;
  for (int c = 0; c < columns; ++c) {
    auto q = by_q_.col(c).head(n), v = by_v_.col(c).head(n);
    q += by * dyn_q.transpose().lazyProduct(end_.by_x.col(c).head(n));
    v += by * dyn_v.transpose().lazyProduct(end_.by_x.col(c).head(n));
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
