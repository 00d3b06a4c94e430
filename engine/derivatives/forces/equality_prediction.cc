#include "counterpoint/engine/derivatives/forces/equality_prediction.h"

#include "counterpoint/engine/derivatives/forces/flight_terms.h"
#include "counterpoint/engine/derivatives/forces/joint_derivatives.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

auto block(const Tree& tree, MatrixX& m) {
  const int n = tree.v_end - tree.v_begin;
  return m.block(tree.v_begin, tree.v_begin, n, n);
}

}  // namespace

EqualityPrediction::EqualityPrediction(const Model& model)
    : sweep_(model),
      forces_(model),
      group_(static_cast<size_t>(model.num_trees()), -1),
      V_(static_cast<size_t>(model.num_bodies())),
      zero_(VectorX::Zero(model.nv())) {
  at_ = a_ = zero_;
  coordinates_.reserve(static_cast<size_t>(model.nv()));
}

int EqualityPrediction::root(int tree) {
  while (group_[tree] != tree) tree = group_[tree] = group_[group_[tree]];
  return tree;
}

/// Groups the trees that equalities of the prediction couple.
void EqualityPrediction::group(const Step& step) {
  std::fill(group_.begin(), group_.end(), -1);
  for_each_constraint(step.model, step.predictor.equalities(), [&](int a, int b) {
    for (const int t : {a, b})
      if (t >= 0 && group_[t] < 0) group_[t] = t;
    if (a >= 0 && b >= 0) group_[root(a)] = root(b);
  });
}

/// Adds the impulses of the equalities to forces_, and the derivatives of their biases to rows_q_,
/// rows_v_ and in_second_.
void EqualityPrediction::add_equalities(const Step& step, const Stage& stage) {
  const ConstraintSet& equalities = step.predictor.equalities();
  const ConstraintSet& all = *step.inverted.constraints;
  const Kinematics& data = step.inverted.at();
  PairResponse response;
  for (size_t i = 0; i < equalities.pairs.size(); ++i) {
    PairConstraint pair = equalities.pairs[i];
    const ActingClosure& acting = all.closures[step.predictor.equality_closures()[i]];
    const bool aimed = stage.in != nullptr && step.predictor.aims(step.model, pair);
    step.closures.compute(step.model, step.options.contact, step.h, acting, pair, data, aimed);
    for (int row = 0; row < pair.law.rows; ++row)
      pair.law.bias[static_cast<size_t>(row)] = step.closures.bias[row];
    const double scale = 1.0 / (pair.law.regularizer * step.h);
    step.closures.add_to(rows_q_, scale, step.closures.by_q);
    step.closures.add_to(rows_v_, scale, step.closures.by_v);
    if (aimed) step.closures.add_to(in_second_, scale, step.closures.by_w);
    const PairBodies bodies = pair_bodies(pair, data, V_);
    find_contact_response(pair, bodies, closure_motion(step.model, acting, pair, data), LawSlopes(),
                          false, step.h, response);
    forces_.add_pair(step.model, pair, bodies, response, step.h, data);
  }
}

void EqualityPrediction::sweep(const Step& step, const Stage& stage, InverseDerivatives& out) {
  const Model& model = step.model;
  SweepInput in;
  at_ = step.v;
  a_ = (*stage.out - step.v) / step.h;
  in.v = at_.data();
  in.a = a_.data();
  in.gravity = step.gravity;
  in.v_next = stage.out->data();
  in.v_start = step.v.data();
  in.mass_in_next = 1.0 / step.h;
  forces_.put_into(in);
  const SweepOutput to{out.dq, out.dv, out.dv_next};
  for (int t = 0; t < model.num_trees(); ++t) {
    if (group_[t] < 0) continue;
    const Tree& tree = model.trees()[t];
    const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
    if (step.predicted[t] && stage.in != nullptr)
      at_(part) = 0.5 * (step.v(part) + (*stage.in)(part));
    if (tree.body_end - tree.body_begin == 1 &&
        step.inverted.start.velocity_forces().has_mean_force[tree.body_begin])
      at_(part).setZero();
    sweep_.run(model, tree, step.inverted.at(), in, to);
    if (!step.predicted[t]) continue;
    // At v, dn/dv = 2 B(v, .); dn/dv is linear in the velocity.
    if (stage.in == nullptr) {
      block(tree, in_last_) = 0.5 * block(tree, out.dv);
    } else {
      block(tree, out.dv) -= block(tree, in_last_);
    }
  }
  forces_.add_couplings(model, in, sweep_, to);
}

/// Differentiates r_k by q, v and w_out, without the mass in dv. In the
/// derivative by q velocity-dependent forces are n((v + w_in) / 2).
void EqualityPrediction::differentiate(const Step& step, const Stage& stage,
                                       InverseDerivatives& out) {
  const int nv = step.model.nv();
  for (MatrixX* m : {&out.dq, &out.dv, &out.dv_next, &rows_q_, &rows_v_}) m->setZero(nv, nv);
  compute_body_velocities(step.model, *stage.out, step.inverted.at(), V_);
  forces_.begin();
  for (int n = 0; n < step.inverted.start.free_flight().num_flyers(); ++n) {
    const int i = step.inverted.start.free_flight().body(n);
    forces_.add_load(i, step.inverted.start.velocity_forces().mean_force[i] * -1.0);
  }
  add_equalities(step, stage);
  sweep(step, stage, out);
  out.dq += rows_q_;
  out.dv += rows_v_;
  add_flight_derivatives(step.model, step.h, step.v, step.gravity,
                         step.inverted.start.free_flight(), step.inverted.at(), out);
  add_joint_force_derivatives(step.model, step.effects.without({Effect::kServos}), step.h, out);
  add_joint_row_derivatives(step.options, step.predictor.equalities(), *stage.out,
                            step.inverted.finder.weights(), out);
}

/// Adds the remaining terms of B(v, w) = n((v + w) / 2) - n((v - w) / 2), w = w1, and those of the
/// mass.
void EqualityPrediction::add_between(const Step& step) {
  SweepInput in;
  in.v = at_.data();
  in.a = zero_.data();
  for (int t = 0; t < step.model.num_trees(); ++t) {
    if (group_[t] < 0) continue;
    const Tree& tree = step.model.trees()[t];
    const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
    at_(part) = 0.5 * (step.v(part) - step.predictor.first_velocity()(part));
    sweep_.run(step.model, tree, step.inverted.at(), in,
               {between_.dq, between_.dv, between_.dv_next});
    block(tree, first_.dv) -= block(tree, between_.dv_next) / step.h;
    block(tree, second_.dv) -= block(tree, between_.dv_next) / step.h;
    if (step.predicted[t]) block(tree, second_.dq) -= block(tree, between_.dq);
  }
}

/// Adds the same terms of the step itself to d, and those of closures whose bias is aimed with w2.
void EqualityPrediction::add_last(const Step& step, const VectorX& other, bool at_rest,
                                  InverseDerivatives& d) {
  SweepInput in;
  in.v = at_.data();
  in.a = zero_.data();
  for (int t = 0; t < step.model.num_trees(); ++t) {
    if (group_[t] < 0 || !step.predicted[t]) continue;
    const Tree& tree = step.model.trees()[t];
    const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
    at_(part) = 0.5 * (step.v(part) - other(part));
    sweep_.run(step.model, tree, step.inverted.at(), in,
               {between_.dq, between_.dv, between_.dv_next});
    block(tree, d.dq) -= block(tree, between_.dq);
    block(tree, d.dv) -= block(tree, in_last_);
  }
  if (step.predictor.equalities().pairs.empty()) return;
  step.closures.aim(step.model, step.h, step.q, step.predictor.velocity());
  const ConstraintSet& all = *step.inverted.constraints;
  for (const int index : step.predictor.equality_closures()) {
    const PairConstraint& pair = all.pairs[all.contacts.size() + static_cast<size_t>(index)];
    if (!step.predictor.aims(step.model, pair)) continue;
    step.closures.compute(step.model, step.options.contact, step.h, all.closures[index], pair,
                          step.inverted.at(), true);
    const double scale = 1.0 / (pair.law.regularizer * step.h);
    if (!at_rest) step.closures.add_to(d.dq, scale, step.closures.by_q);
    step.closures.add_to(d.dv, scale, step.closures.by_v);
    step.closures.add_to(in_last_, scale, step.closures.by_w);
  }
}

/// Solves for the adjoints of the group of a tree, and adds their terms to d.
bool EqualityPrediction::close(const Step& step, int first, bool at_rest, InverseDerivatives& d) {
  coordinates_.clear();
  for (int t = first; t < step.model.num_trees(); ++t) {
    if (group_[t] < 0 || root(t) != root(first)) continue;
    const Tree& tree = step.model.trees()[t];
    for (int k = tree.v_begin; k < tree.v_end; ++k) coordinates_.push_back(k);
  }
  const auto n = static_cast<Eigen::Index>(coordinates_.size());
  const auto gather = [&](const MatrixX& from, MatrixX& to) {
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = 0; i < n; ++i) to(i, j) = from(coordinates_[i], coordinates_[j]);
  };
  const auto A = A_.topLeftCorner(n, n), part = part_.topLeftCorner(n, n);
  auto X = X_.topLeftCorner(n, n), Y = Y_.topLeftCorner(n, n);
  gather(first_.dv_next, A_);
  const auto solve = [&](const auto& right) {  // X = inv(A) right
    solver_.begin(A, static_cast<int>(n));
    solver_.add(right, 0, 1.0);
    if (!solver_.solve()) return false;
    solver_.get(0, X);
    return true;
  };
  const auto add = [&](double sign, const MatrixX& slopes, MatrixX& to) {  // adds sign X' slopes
    gather(slopes, part_);
    Y.noalias() = X.transpose().lazyProduct(part);
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = 0; i < n; ++i) to(coordinates_[i], coordinates_[j]) += sign * Y(i, j);
  };
  gather(in_last_, part_);
  Y = part.transpose();
  if (!solve(Y)) return false;
  if (!at_rest) add(-1.0, second_.dq, d.dq);
  add(-1.0, second_.dv, d.dv);
  gather(in_second_, part_);
  Y.noalias() = part.transpose().lazyProduct(X);
  if (!solve(Y)) return false;
  if (!at_rest) add(1.0, first_.dq, d.dq);
  add(1.0, first_.dv, d.dv);
  return true;
}

bool EqualityPrediction::add(const InverseArguments& of, const Given& given,
                             const InvertedStep& inverted, ClosureDerivator& closures,
                             InverseDerivatives& d) {
  const auto& [predictor, predicted, other, at_rest] = given;
  const Model& model = of.model;
  if (!predictor.any() || predictor.equalities().empty()) return true;
  if (!predictor.refined()) return false;
  const Vector3 gravity =
      of.effects.has(Effect::kGravity) ? model.gravity() : Vector3(Vector3::Zero());
  const Step step{model,     of.options, of.effects, of.q,   of.v,   predictor,
                  predicted, inverted,   closures,   of.h(), gravity};
  const int nv = model.nv();
  for (MatrixX* m : {&A_, &X_, &Y_, &part_, &between_.dq, &between_.dv, &between_.dv_next})
    if (m->rows() != nv) m->setZero(nv, nv);
  in_last_.setZero(nv, nv);
  group(step);
  differentiate(step, {nullptr, &predictor.first_velocity()}, first_);
  in_second_ = in_last_;
  if (!predictor.equalities().pairs.empty())
    closures.aim(model, step.h, of.q, predictor.first_velocity());
  differentiate(step, {&predictor.first_velocity(), &predictor.velocity()}, second_);
  add_between(step);
  add_last(step, other, at_rest, d);
  bool regular = true;
  for (int t = 0; t < model.num_trees(); ++t) {
    if (group_[t] < 0) continue;
    bool is_first = true;
    for (int s = 0; s < t; ++s) is_first = is_first && !(group_[s] >= 0 && root(s) == root(t));
    if (is_first) regular = close(step, t, at_rest, d) && regular;
  }
  return regular;
}

}  // namespace counterpoint
