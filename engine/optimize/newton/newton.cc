#include "counterpoint/engine/optimize/newton/newton.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/clocks.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::optimization {
namespace {

/// Largest step of a coordinate [m, rad], beyond which the linearization is invalid.
constexpr double kMaxStep = 0.5;
/// Largest change of log h in a step.
constexpr double kMaxTimeStep = 0.2;
/// Lower bound of the damped diagonal, for coordinates without weight.
constexpr double kLeastDiagonal = 1e-4;

/// Adds block (a, b) of an instant's Gram matrix to out, in coordinates of possibly mirrored
/// frames.
void add_block(const MatrixX& gram, int nv, int a, int b, const Mirror* mirror_a,
               const Mirror* mirror_b, MatrixX& out) {
  // the mirror of each side
  const auto block = gram.block(a * nv, b * nv, nv, nv);
  if (mirror_a == nullptr && mirror_b == nullptr) {
    out += block;
    return;
  }
  for (int j = 0; j < nv; ++j) {
    const int to_j = mirror_b ? mirror_b->v_index[static_cast<std::size_t>(j)] : j;
    const double sign_j = mirror_b ? mirror_b->v_sign[j] : 1.0;
    for (int i = 0; i < nv; ++i) {
      const int to_i = mirror_a ? mirror_a->v_index[static_cast<std::size_t>(i)] : i;
      const double sign_i = mirror_a ? mirror_a->v_sign[i] : 1.0;
      out(to_i, to_j) += sign_i * sign_j * block(i, j);
    }
  }
}

}  // namespace

Newton::Newton(const Problem& problem, const std::vector<VectorX>& frames, int num_threads)
    : problem_(&problem),
      layout_(problem),
      frames_(problem, frames),
      pool_(num_threads_of(num_threads)),
      system_(frames_.num_slots(), problem.model->nv(), problem.periodic) {
  for (int i = 0; i < pool_.size(); ++i)
    evaluators_.push_back(std::make_unique<Evaluator>(problem));
  const auto instants = static_cast<std::size_t>(frames_.num_instants());
  values_.resize(instants);
  trial_values_.resize(instants);
  normal_.resize(instants);
  for (std::size_t t = 0; t < instants; ++t)
    multipliers_.push_back(VectorX::Zero(layout_.rows(static_cast<int>(t))));
}

void Newton::begin(const Stage& stage, bool scale) {
  const double ratio = scale ? stage_.penalty / stage.penalty : 1.0;
  for (VectorX& multiplier : multipliers_) multiplier *= ratio;
  stage_ = stage;
  damping_.begin();
  cost_ = evaluate(values_);
}

double Newton::evaluate(std::vector<InstantValues>& values) {
  stage_.options.time_step = frames_.time_step();
  pool_.run(frames_.num_instants(), [&](int t, int thread) {
    const auto i = static_cast<std::size_t>(t);
    evaluators_[static_cast<std::size_t>(thread)]->evaluate(layout_, frames_, stage_, t,
                                                            multipliers_[i], values[i], nullptr);
  });
  return cost_of(values);
}

double Newton::cost_of(const std::vector<InstantValues>& values) {
  double sum = 0.0;
  for (const InstantValues& v : values) sum += 0.5 * v.residual.squaredNorm();
  return std::isfinite(sum) ? sum : kInfinity;
}

void Newton::linearize() {
  stage_.options.time_step = frames_.time_step();
  pool_.run(frames_.num_instants(), [&](int t, int thread) {
    const auto i = static_cast<std::size_t>(t);
    evaluators_[static_cast<std::size_t>(thread)]->evaluate(
        layout_, frames_, stage_, t, multipliers_[i], values_[i], &normal_[i]);
  });
  cost_ = cost_of(values_);
  assemble();
}

// The sum runs in the order of instants, so that the result does not depend on the threads.
void Newton::assemble() {
  system_.set_zero();
  gradient_.setZero(problem_->model->nv(), frames_.num_slots());
  border_.setZero(problem_->model->nv(), frames_.num_slots());
  time_gram_ = time_gradient_ = time_curvature_ = 0.0;
  for (int t = 0; t < frames_.num_instants(); ++t) add_to_system(t);
  shift_.resize(problem_->model->nv(), frames_.num_slots());
  for (int i = 0; i < frames_.num_slots(); ++i)
    shift_.col(i) = system_.block(i, i).diagonal().cwiseMax(kLeastDiagonal);
  time_hessian_ = time_gram_ + std::max(time_curvature_, 0.0);
  time_shift_ = std::max(time_hessian_, kLeastDiagonal);
}

/// Adds `scale` times B to the system.
void Newton::add_metric(double scale) {
  for (int t = 0; t < problem_->steps; ++t) {
    const FrameSource next = frames_.source(t + 1);
    if (next.slot < 0) continue;
    const Mirror* mirror = next.mirrored ? &*problem_->mirror : nullptr;
    metric_ = scale * normal_[static_cast<std::size_t>(t)].metric;
    add_block(metric_, problem_->model->nv(), 0, 0, mirror, mirror,
              system_.block(next.slot, next.slot));
  }
}

/// Adds to the derivatives of an instant by log h the motion of fixed frames with it.
void Newton::add_fixed_frames(int instant, NormalEquations& normal) {
  const Eigen::Index nv = problem_->model->nv();
  bool any = false;
  moved_.setZero(3 * nv);
  for (int a = 0; a < 3; ++a) {
    if (!frames_.moves_with_time(instant - 1 + a, moved_frame_)) continue;
    moved_.segment(a * nv, nv) = moved_frame_;
    any = true;
  }
  if (!any) return;
  moved_rows_.noalias() = normal.gram.selfadjointView<Eigen::Lower>() * moved_;
  normal.time_gram += moved_.dot(2.0 * normal.by_time + moved_rows_);
  normal.by_time += moved_rows_;
  normal.time_gradient += moved_.dot(normal.gradient);
}

void Newton::add_to_system(int instant) {
  const int nv = problem_->model->nv();
  NormalEquations& normal = normal_[static_cast<std::size_t>(instant)];
  FrameSource sources[3];
  for (int a = 0; a < 3; ++a) sources[a] = frames_.source(instant - 1 + a);
  if (!problem_->periodic && instant == problem_->steps) sources[2].slot = -1;
  const auto mirror = [&](int a) { return sources[a].mirrored ? &*problem_->mirror : nullptr; };
  if (problem_->duration) {
    add_fixed_frames(instant, normal);
    time_gram_ += normal.time_gram;
    time_gradient_ += normal.time_gradient;
    time_curvature_ += normal.time_curvature;
  }
  for (int a = 0; a < 3; ++a) {
    if (sources[a].slot < 0) continue;
    for (int j = 0; j < nv; ++j) {
      const Mirror* m = mirror(a);
      const int to = m ? m->v_index[static_cast<std::size_t>(j)] : j;
      const double sign = m ? m->v_sign[j] : 1.0;
      gradient_(to, sources[a].slot) += sign * normal.gradient[a * nv + j];
      border_(to, sources[a].slot) += sign * normal.by_time[a * nv + j];
    }
    for (int b = 0; b <= a; ++b) {
      if (sources[b].slot < 0) continue;
      if (a == b) {  // both triangles, since a mirror exchanges them
        auto block = normal.gram.block(a * nv, a * nv, nv, nv);
        block.triangularView<Eigen::StrictlyUpper>() = block.transpose();
      }
      if (sources[b].slot <= sources[a].slot) {
        add_block(normal.gram, nv, a, b, mirror(a), mirror(b),
                  system_.block(sources[a].slot, sources[b].slot));
      } else {
        const MatrixX turned = normal.gram.block(a * nv, b * nv, nv, nv).transpose();
        add_block(turned, nv, 0, 0, mirror(b), mirror(a),
                  system_.block(sources[b].slot, sources[a].slot));
      }
    }
  }
}

/// Solves for step_ and time_step_ with the factored system: step_ as a linear function of log h,
/// whose parabola then has its minimum within the bounds. Returns false if there is none.
bool Newton::solve() {
  step_ = -gradient_;
  system_.solve(step_, pool_);
  time_step_ = 0.0;
  if (problem_->duration) {
    column_ = border_;
    system_.solve(column_, pool_);
    const double curvature =
        time_hessian_ + damping_.value() * time_shift_ - border_.reshaped().dot(column_.reshaped());
    if (!(curvature > 0.0)) return false;
    const double duration = problem_->steps * frames_.time_step();
    const double least = std::log(problem_->duration->least / duration);
    const double most = std::log(problem_->duration->most / duration);
    time_step_ = -(time_gradient_ + border_.reshaped().dot(step_.reshaped())) / curvature;
    time_step_ =
        std::clamp(time_step_, std::max(least, -kMaxTimeStep), std::min(most, kMaxTimeStep));
    step_ -= time_step_ * column_;
  }
  return step_.allFinite();
}

/// Decrease of the cost that the linear model predicts for step_ and time_step_.
double Newton::expected_decrease() const {
  double expected = -time_step_ * (time_gradient_ + 0.5 * time_hessian_ * time_step_ +
                                   0.5 * border_.reshaped().dot(step_.reshaped()));
  for (Eigen::Index i = 0; i < step_.cols(); ++i)
    expected += -0.5 * step_.col(i).dot(gradient_.col(i)) +
                0.5 * damping_.value() * step_.col(i).dot(shift_.col(i).cwiseProduct(step_.col(i)));
  return expected;
}

/// Moves the frames by step_, limited to `bound`, and h by time_step_, if that lowers the cost.
/// Returns the decrease.
double Newton::try_step(double bound, Iteration& iteration) {
  const double expected = expected_decrease();
  iteration.step = step_.cwiseAbs().maxCoeff();
  if (iteration.step > bound) {
    step_ *= bound / iteration.step;
    time_step_ *= bound / iteration.step;
    iteration.step = bound;
  }
  kept_ = frames_.variables();
  frames_.move(step_, time_step_);
  const double cost = evaluate(trial_values_);
  const double decrease = cost_ - cost;
  if (!(decrease > 0.0)) {
    frames_.set_variables(kept_);
    damping_.reject();
    return 0.0;
  }
  damping_.accept(decrease, expected);
  values_.swap(trial_values_);
  cost_ = cost;
  return decrease;
}

Iteration Newton::iterate(int most_trials) {
  Iteration iteration;
  double start = wall_seconds();
  const auto lap = [&](double& sum) {
    const double now = wall_seconds();
    sum += now - start;
    start = now;
  };
  linearize();
  lap(iteration.linearize_seconds);
  double added = 0.0;  // mu of the B that is in the system
  while (iteration.trials < most_trials && !iteration.accepted) {
    ++iteration.trials;
    if (stage_.contact_damping > 0.0) add_metric(damping_.value() - added);
    added = damping_.value();
    const bool solved = system_.factor(damping_.value(), shift_, pool_) && solve();
    lap(iteration.factor_seconds);
    if (!solved) {
      damping_.strengthen();
      continue;
    }
    iteration.decrease = try_step(kMaxStep, iteration);
    iteration.accepted = iteration.decrease > 0.0;
    lap(iteration.trial_seconds);
    if (Damping::exhausted(damping_.value())) break;
  }
  if (!iteration.accepted) damping_.limit(1e2);
  iteration.cost = cost_;
  iteration.damping = damping_.value();
  return iteration;
}

namespace {

template <class Wanted>
Spread spread_of(const Problem& problem, const Layout& layout,
                 const std::vector<InstantValues>& values, Wanted wanted) {
  Spread spread;
  int instants = 0;
  for (std::size_t t = 0; t < values.size(); ++t) {
    double largest = 0.0;
    bool any = false;
    for (const Span& span : layout.spans(static_cast<int>(t))) {
      if (!wanted(problem.terms[static_cast<std::size_t>(span.term)])) continue;
      any = true;
      largest = std::max(largest,
                         values[t].violation.segment(span.first, span.rows).cwiseAbs().maxCoeff());
    }
    if (!any) continue;
    ++instants;
    spread.max = std::max(spread.max, largest);
    spread.mean += largest;
  }
  if (instants > 0) spread.mean /= instants;
  return spread;
}

}  // namespace

Spread Newton::violation() const {
  return spread_of(*problem_, layout_, values_, [](const Term& term) { return term.condition; });
}

Spread Newton::unactuated() const {
  return spread_of(*problem_, layout_, values_, [](const Term& term) {
    return term.condition && term.quantity == Quantity::kUnactuatedForce;
  });
}

void Newton::update_multipliers(double limit) {
  const bool near = violation().max < limit;
  for (std::size_t t = 0; t < multipliers_.size(); ++t) {
    if (near) {
      multipliers_[t] += values_[t].violation;
    } else {
      multipliers_[t] *= 0.5;
    }
  }
  cost_ = evaluate(values_);
}

VectorX Newton::cost_by_term() const {
  VectorX costs = VectorX::Zero(static_cast<Eigen::Index>(problem_->terms.size()));
  for (std::size_t t = 0; t < values_.size(); ++t)
    for (const Span& span : layout_.spans(static_cast<int>(t)))
      costs[span.term] += 0.5 * values_[t].residual.segment(span.first, span.rows).squaredNorm();
  return costs;
}

}  // namespace counterpoint::optimization
