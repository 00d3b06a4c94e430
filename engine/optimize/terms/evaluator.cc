#include "counterpoint/engine/optimize/terms/evaluator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/terms/effort_limits.h"

namespace counterpoint::optimization {
namespace {

bool of_forces(Quantity quantity) {
  return quantity == Quantity::kAppliedForce || quantity == Quantity::kEffortLimits ||
         quantity == Quantity::kUnactuatedForce;
}

/// Excess of each force over the effort limit of its joint; 0 within it.
void effort_excess(const Model& model, const VectorX& force, VectorX& out) {
  out = force;
  clamp_to_effort_limits(model, out);
  out = force - out;
}

/// Excess of each limited coordinate over the limits tightened by `length`; 0 within them.
void limit_excess(const Model& model, const VectorX& q, double length, VectorX& out) {
  out.setZero(model.nv());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    if (joint_nq(body.joint_type) != 1) continue;
    const double x = q[body.q_index];
    if (x < joint.lower + length) out[body.v_index] = x - joint.lower - length;
    if (x > joint.upper - length) out[body.v_index] = x - joint.upper + length;
  }
}

}  // namespace

Layout::Layout(const Problem& problem) {
  const int instants = problem.periodic ? problem.steps : problem.steps + 1;
  spans_.resize(static_cast<std::size_t>(instants));
  rows_.assign(static_cast<std::size_t>(instants), 0);
  for (std::size_t i = 0; i < problem.terms.size(); ++i) {
    const Term& term = problem.terms[i];
    if (term.quantity == Quantity::kDuration) {
      spans_[0].push_back({static_cast<int>(i), rows_[0]++, 1});
      continue;
    }
    const bool step = of_step(term.quantity);
    const int count = step ? problem.steps : instants;
    const auto resolved = [&](int frame) { return frame < 0 ? frame + count : frame; };
    // Terms of a frame 0 that is fixed are constant.
    const int least = step || problem.periodic || problem.free_start ? 0 : 1;
    const int first = std::max(least, resolved(term.frames.first));
    const int last = std::min(count - 1, resolved(term.frames.last));
    for (int t = first; t <= last; ++t) {
      if (!term.active.empty() && !term.active[static_cast<std::size_t>(t)]) continue;
      int& rows = rows_[static_cast<std::size_t>(t)];
      const int size = rows_of(*problem.model, term.quantity);
      spans_[static_cast<std::size_t>(t)].push_back({static_cast<int>(i), rows, size});
      rows += size;
    }
  }
}

Evaluator::Evaluator(const Problem& problem)
    : problem_(&problem),
      model_(problem.model),
      rotations_(rotation_starts(*problem.model)),
      workspace_(*problem.model),
      before_(*problem.model),
      at_(*problem.model),
      scratch_data_(*problem.model),
      scratch_(*problem.model),
      v_(VectorX::Zero(problem.model->nv())),
      w_(VectorX::Zero(problem.model->nv())),
      difference_(VectorX::Zero(problem.model->nv())) {
  std::vector<int>& bodies = derivatives_.contacts.bodies;
  for (const Term& term : problem.terms)
    if (term.quantity == Quantity::kContactForce &&
        std::find(bodies.begin(), bodies.end(), term.body) == bodies.end())
      bodies.push_back(term.body);
}

void Evaluator::gather(const Frames& frames, int instant, bool step) {
  const double h = h_ = frames.time_step();
  frames.read(instant - 1, q_before_);
  frames.read(instant, q_);
  configuration_difference(*model_, q_before_, q_, difference_);
  v_ = difference_ / h;
  differentiate_difference(difference_, rotations_, v_by_before_, v_by_at_);
  v_by_before_ *= 1.0 / h;
  v_by_at_ *= 1.0 / h;
  if (!step) return;
  frames.read(instant + 1, q_next_);
  configuration_difference(*model_, q_, q_next_, difference_);
  w_ = difference_ / h;
  differentiate_difference(difference_, rotations_, w_by_at_, w_by_next_);
  w_by_at_ *= 1.0 / h;
  w_by_next_ *= 1.0 / h;
}

void Evaluator::evaluate(const Layout& layout, const Frames& frames, const Stage& stage,
                         int instant, const VectorX& multiplier, InstantValues& out,
                         NormalEquations* normal) {
  const bool step = problem_->periodic || instant < problem_->steps;
  const int nv = model_->nv();
  gather(frames, instant_ = instant, step);
  restoring_ = stage.restoring;
  out.residual.setZero(layout.rows(instant));
  out.violation.setZero(layout.rows(instant));
  num_dense_ = 0;
  if (dense_.rows() < layout.rows(instant)) {  // only the first num_dense_ rows are used
    dense_.resize(layout.rows(instant), 3 * nv);
    dense_residual_.resize(layout.rows(instant));
    dense_by_time_.resize(layout.rows(instant));
  }
  force_weight2_.setZero(nv);
  force_gradient_.setZero(nv);
  if (normal != nullptr) {
    normal->gram.setZero(3 * nv, 3 * nv);
    normal->gradient.setZero(3 * nv);
    normal->by_time.setZero(3 * nv);
    normal->time_gram = normal->time_gradient = normal->time_curvature = 0.0;
  }
  out.applied_force.setZero(step ? nv : 0);
  bool poses = false, forces = false;
  for (const Span& span : layout.spans(instant)) {
    const Quantity quantity = problem_->terms[static_cast<std::size_t>(span.term)].quantity;
    forces = forces || of_forces(quantity) || quantity == Quantity::kContactForce;
    poses = poses || !(of_coordinates(quantity) || quantity == Quantity::kContactForce);
  }
  if (poses) {
    compute_poses(*model_, q_before_, before_);
    compute_poses(*model_, q_, at_);
  }
  if (step && forces) {
    find_forces(stage, normal);
    out.applied_force = inverse_.applied_force;
    if (inverse_.fault.any()) {
      out.residual.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
  }
  for (const Span& span : layout.spans(instant)) {
    const Term& term = problem_->terms[static_cast<std::size_t>(span.term)];
    if (!term.known_at(instant)) continue;
    const double factor = term.condition            ? std::sqrt(stage.penalty)
                          : term.late_weight != 1.0 ? std::pow(term.late_weight, stage.late)
                                                    : 1.0;
    if (of_forces(term.quantity))
      evaluate_forces(term, span, factor, multiplier, out, normal != nullptr);
    else if (of_coordinates(term.quantity))
      evaluate_coordinates(term, span, factor, multiplier, out, normal);
    else
      evaluate_dense(term, span, factor, multiplier, out, normal);
  }
  if (normal != nullptr) add_dense_rows(*normal);
}

/// Finds the forces of a step; for the linearization with their derivatives.
void Evaluator::find_forces(const Stage& stage, NormalEquations* normal) {
  if (normal == nullptr) {
    step_inverse(*model_, stage.options, q_, v_, w_, nothing_, workspace_, inverse_);
    return;
  }
  step_inverse_derivatives(*model_, stage.options, q_, v_, w_, nothing_, workspace_, inverse_,
                           derivatives_, stage.derivatives);
  if (stage.contact_damping > 0.0) find_metric(stage, normal->metric);
  if (problem_->duration) differentiate_by_time(stage);
}

/// Sets residual and violation of a term from its value.
void Evaluator::set_rows(const Term& term, const Span& span, double factor,
                         const VectorX& multiplier, const VectorRef& value,
                         InstantValues& out) const {
  auto residual = out.residual.segment(span.first, span.rows);
  residual = value;
  const VectorX& target = term.target_at(instant_);
  if (target.size() == span.rows && term.quantity != Quantity::kConfiguration &&
      term.quantity != Quantity::kClearance)
    residual -= target;
  residual = residual.cwiseProduct(term.weight);
  if (!term.condition) {
    residual *= restoring_ ? 0.0 : factor;
    return;
  }
  out.violation.segment(span.first, span.rows) = residual;
  if (!restoring_) residual += multiplier.segment(span.first, span.rows);
  residual *= factor;
}

void Evaluator::evaluate_forces(const Term& term, const Span& span, double factor,
                                const VectorX& multiplier, InstantValues& out, bool derivatives) {
  const bool limits = term.quantity == Quantity::kEffortLimits;
  if (limits) {
    effort_excess(*model_, inverse_.applied_force, value_);
  } else {
    value_ = inverse_.applied_force;
  }
  weight_ = factor * term.weight;
  if (limits) weight_ = (value_.array() == 0.0).select(0.0, weight_);
  set_rows(term, span, factor, multiplier, value_, out);
  if (!derivatives) return;
  force_weight2_ += weight_.cwiseAbs2();
  force_gradient_ += weight_.cwiseProduct(out.residual.segment(span.first, span.rows));
}

void Evaluator::evaluate_coordinates(const Term& term, const Span& span, double factor,
                                     const VectorX& multiplier, InstantValues& out,
                                     NormalEquations* normal) {
  const TangentMap* maps[3] = {nullptr, nullptr, nullptr};
  weight_ = factor * term.weight;
  switch (term.quantity) {
    case Quantity::kConfiguration:
      value_.resize(model_->nv());
      configuration_difference(*model_, term.target_at(instant_), q_, value_);
      differentiate_difference(value_, rotations_, by_target_, by_q_);
      maps[1] = &by_q_;
      break;
    case Quantity::kVelocity:
      value_ = v_;
      maps[0] = &v_by_before_;
      maps[1] = &v_by_at_;
      break;
    case Quantity::kJointLimits:
      limit_excess(*model_, q_, term.length, value_);
      by_q_.set_identity(model_->nv(), rotations_.size());
      maps[1] = &by_q_;
      for (Eigen::Index i = 0; i < value_.size(); ++i)
        if (value_[i] == 0.0) weight_[i] = 0.0;
      break;
    default: {  // kAcceleration
      const double rate = 1.0 / h_;
      value_ = (w_ - v_) * rate;
      sum_ = v_by_at_;
      sum_ *= -1.0;
      sum_ += w_by_at_;
      sum_ *= rate;
      by_target_ = v_by_before_;
      by_target_ *= -rate;
      by_q_ = w_by_next_;
      by_q_ *= rate;
      maps[0] = &by_target_;
      maps[1] = &sum_;
      maps[2] = &by_q_;
    }
  }
  set_rows(term, span, factor, multiplier, value_, out);
  if (normal == nullptr) return;
  const int order = rate_order(term.quantity);
  by_time_ = -order * weight_.cwiseProduct(value_);
  normal->time_curvature -= order * by_time_.dot(out.residual.segment(span.first, span.rows));
  add_coordinate_rows(span, out, maps, *normal);
}

/// Adds the rows of a term with the weights weight_ and the derivatives by_time_ by log h.
void Evaluator::add_coordinate_rows(const Span& span, const InstantValues& out,
                                    const TangentMap* const (&maps)[3],
                                    NormalEquations& normal) const {
  const Eigen::Index nv = model_->nv();
  const VectorX& weight = weight_;
  const auto r = out.residual.segment(span.first, span.rows);
  normal.time_gram += by_time_.squaredNorm();
  normal.time_gradient += by_time_.dot(r);
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < nv;) {
    const bool turns = next < rotations_.size() && rotations_[next] == i;
    const Eigen::Index size = turns ? 3 : 1;
    if (weight.segment(i, size).isZero(0.0)) {
      i += size;
      next += turns ? 1 : 0;
      continue;
    }
    for (Eigen::Index a = 0; a < 3; ++a) {
      if (maps[a] == nullptr) continue;
      if (!turns) {
        const double scaled = weight[i] * maps[a]->diagonal[i];
        normal.gradient[a * nv + i] += scaled * r[i];
        normal.by_time[a * nv + i] += scaled * by_time_[i];
        for (Eigen::Index b = 0; b <= a; ++b)
          if (maps[b] != nullptr)
            normal.gram(a * nv + i, b * nv + i) += scaled * weight[i] * maps[b]->diagonal[i];
        continue;
      }
      const auto w = weight.segment<3>(i).asDiagonal();
      const Matrix3 A = w * maps[a]->blocks[next];
      normal.gradient.segment<3>(a * nv + i) += A.transpose() * r.segment<3>(i);
      normal.by_time.segment<3>(a * nv + i) += A.transpose() * by_time_.segment<3>(i);
      for (Eigen::Index b = 0; b <= a; ++b)
        if (maps[b] != nullptr)
          normal.gram.block<3, 3>(a * nv + i, b * nv + i) +=
              A.transpose() * (w * maps[b]->blocks[next]);
    }
    i += size;
    next += turns ? 1 : 0;
  }
}

/// Adds the rows of all applied forces at once, with their summed squared weights, and the dense
/// rows.
void Evaluator::add_dense_rows(NormalEquations& normal) {
  const Eigen::Index nv = model_->nv();
  if (!force_weight2_.isZero(0.0)) {
    force_rows_.setZero(nv, 3 * nv);
    auto at = force_rows_.middleCols(nv, nv);
    at = derivatives_.dq;
    add_product(derivatives_.dv, v_by_before_, rotations_, force_rows_.leftCols(nv));
    add_product(derivatives_.dv, v_by_at_, rotations_, at);
    add_product(derivatives_.dv_next, w_by_at_, rotations_, at);
    add_product(derivatives_.dv_next, w_by_next_, rotations_, force_rows_.rightCols(nv));
    normal.gradient.noalias() += force_rows_.transpose() * force_gradient_;
    if (problem_->duration) {
      by_time_ = force_weight2_.cwiseProduct(force_by_time_);
      normal.by_time.noalias() += force_rows_.transpose() * by_time_;
      normal.time_gram += by_time_.dot(force_by_time_);
      normal.time_gradient += force_gradient_.dot(force_by_time_);
      normal.time_curvature += force_gradient_.dot(force_curvature_);
    }
    for (Eigen::Index i = 0; i < nv; ++i) force_rows_.row(i) *= std::sqrt(force_weight2_[i]);
    normal.gram.selfadjointView<Eigen::Lower>().rankUpdate(force_rows_.transpose());
  }
  if (num_dense_ == 0) return;
  const auto rows = dense_.topRows(num_dense_);
  const auto residual = dense_residual_.head(num_dense_);
  normal.gradient.noalias() += rows.transpose() * residual;
  normal.gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  if (!problem_->duration) return;
  const auto by_time = dense_by_time_.head(num_dense_);
  normal.by_time.noalias() += rows.transpose() * by_time;
  normal.time_gram += by_time.squaredNorm();
  normal.time_gradient += by_time.dot(residual);
}

void Evaluator::evaluate_dense(const Term& term, const Span& span, double factor,
                               const VectorX& multiplier, InstantValues& out,
                               NormalEquations* normal) {
  const bool derivatives = normal != nullptr;
  const Eigen::Index nv = model_->nv();
  MatrixX &by_before = by_before_[span.rows - 1], &by_at = by_at_[span.rows - 1];
  Vector3 rows_of_value;
  auto value = rows_of_value.head(span.rows);
  bool chained = false;
  if (term.quantity == Quantity::kContactForce) {
    value = contact_force_on(*model_, inverse_, term.body);
    if (derivatives) take_contact_rows(term);
    chained = true;
  } else if (term.quantity == Quantity::kAngularMomentum) {
    compute_velocities(*model_, v_, at_);
    value = angular_momentum(*model_, at_);
    if (derivatives) differentiate_angular_momentum();
    chained = true;
  } else if (term.quantity == Quantity::kDuration) {
    value[0] = problem_->steps * h_;
    by_before.setZero(1, nv);
    by_at.setZero(1, nv);
  } else {
    evaluate_kinematic({*model_, h_, before_, at_, instant_}, term, scratch_,
                       {value, derivatives ? &by_before : nullptr, derivatives ? &by_at : nullptr});
  }
  set_rows(term, span, factor, multiplier, value, out);
  if (!derivatives) return;
  auto rows = dense_.middleRows(num_dense_, span.rows);
  rows.setZero();
  if (chained) {
    rows.middleCols(nv, nv) = by_q_v_w_[0];
    add_product(by_q_v_w_[1], v_by_before_, rotations_, rows.leftCols(nv));
    add_product(by_q_v_w_[1], v_by_at_, rotations_, rows.middleCols(nv, nv));
    if (of_step(term.quantity)) {
      add_product(by_q_v_w_[2], w_by_at_, rotations_, rows.middleCols(nv, nv));
      add_product(by_q_v_w_[2], w_by_next_, rotations_, rows.rightCols(nv));
    }
  } else {
    rows.leftCols(nv) = by_before;
    rows.middleCols(nv, nv) = by_at;
  }
  const int order = rate_order(term.quantity);
  Vector3 first = Vector3::Zero(), second = Vector3::Zero();  // derivatives by log h
  first.head(span.rows) = -order * value;
  second.head(span.rows) = order * order * value;
  if (term.quantity == Quantity::kContactForce && problem_->duration)
    std::tie(first, second) = contact_force_by_time(term.body);
  for (Eigen::Index i = 0; i < span.rows; ++i) {
    const double weight = factor * term.weight[i];
    rows.row(i) *= weight;
    dense_by_time_[num_dense_ + i] = weight * first[i];
    normal->time_curvature += weight * second[i] * out.residual[span.first + i];
  }
  dense_residual_.segment(num_dense_, span.rows) = out.residual.segment(span.first, span.rows);
  num_dense_ += span.rows;
}

}  // namespace counterpoint::optimization
