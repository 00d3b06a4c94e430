#include "counterpoint/engine/optimize/newton/continuation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/settle.h"

namespace counterpoint::optimization {
namespace {

/// Below this smoothing [m] the motion is only refined, and penalties are constant.
constexpr double kHard = 1e-6;
/// Below this smoothing [m] the contact laws hardly change any more.
constexpr double kUnseen = 2e-9;
/// A stage is rejected if its mean violation exceeds kWorse and kWorseRatio times that of the stage
/// before.
constexpr double kWorse = 0.02, kWorseRatio = 1.2;
/// Below smoothing kFormed [m], where contacts are formed, a stage that ran out of iterations is
/// rejected if its cost exceeds kDearer times that of the stage before: it has lost contacts.
constexpr double kFormed = 1e-3, kDearer = 1.1;
/// The same limit for stages that did not run out of iterations.
constexpr double kMuchDearer = 1.5;
/// Recovery speed [m/s] of overlaps above Continuation::quick_recovery_above; below kSlowRecovery
/// [m] the problem's own options apply.
constexpr double kQuickRecovery = 1e4, kSlowRecovery = 1e-6;
constexpr int kMostRefused = 8;  ///< limit of consecutive rejections
/// While contacts are forming, a stage is accepted as it is after this number of rejections: the
/// start may be a point where no small step helps, which later stages leave.
constexpr int kPatience = 3;
constexpr double kLeastFactor = 1.1;  ///< minimum ratio of the smoothings of two stages
/// Limits at the last smoothing: rounds of polish(), and Newton steps of each restoration.
constexpr int kPolishRounds = 12, kRestoringSteps = 20;
/// Polishing rounds: tolerance of minimizations relative to Settings::tolerance; if a round leaves
/// more than kSlow of a violation, the penalty is multiplied by kSteeper.
constexpr double kExact = 1e-4;
constexpr double kSlow = 0.25, kSteeper = 10.0;
/// Minimum penalty in a restoration. A linear step leaves about the inverse of it of the violation
/// that terms of order one would cause.
constexpr double kRestoringPenalty = 1e7;

double end_of(const Problem& problem, const Settings& settings) {
  return settings.continuation.end.value_or(problem.options.contact.smoothing);
}

}  // namespace

Stage stage_at(const Problem& problem, const Settings& settings, double smoothing) {
  const Continuation& c = settings.continuation;
  Stage stage;
  stage.derivatives = settings.derivatives;
  stage.contact_damping = settings.continuation.contact_damping;
  stage.options = problem.options;
  stage.options.push_deep = true;
  ContactOptions& contact = stage.options.contact;
  contact.smoothing = smoothing;
  contact.compliance =
      std::max(contact.compliance, std::min(1.0, c.compliance_per_metre * smoothing));
  contact.margin = std::max(contact.margin, c.margin_per_smoothing * smoothing);
  // The change is gradual, so that a motion that relies on quick recovery can adapt.
  const double quick = std::clamp(
      std::log(smoothing / kSlowRecovery) / std::log(c.quick_recovery_above / kSlowRecovery), 0.0,
      1.0);
  const auto between = [&](double end, double start) {
    return end > 0.0 ? end * std::pow(start / end, quick) : quick > 0.0 ? start : end;
  };
  contact.stabilization = between(contact.stabilization, 1.0);
  contact.max_recovery_speed = between(contact.max_recovery_speed, kQuickRecovery);
  if (smoothing > c.limits_below) stage.options.effects.set(Effect::kLimits, false);
  const double way =
      c.start > kHard ? std::log(c.start / std::max(smoothing, kHard)) / std::log(c.start / kHard)
                      : 1.0;
  stage.late =
      std::clamp(std::log(kLateFrom / smoothing) / std::log(kLateFrom / kLateTo), 0.0, 1.0);
  stage.penalty =
      c.penalty_start * std::pow(c.penalty_end / c.penalty_start, std::clamp(way, 0.0, 1.0));
  return stage;
}

Continuing::Continuing(const Problem& problem, const std::vector<VectorX>& start,
                       const Settings& settings)
    : problem_(&problem),
      settings_(&settings),
      newton_(problem, start, settings.threads),
      workspace_(*problem.model),
      start_seconds_(wall_seconds()),
      smoothing_(std::max(settings.continuation.resume_at.value_or(settings.continuation.start),
                          end_of(problem, settings))),
      last_good_(smoothing_),
      factor_(settings.continuation.factor) {}

void Continuing::settle_ends() {
  if (!problem_->settle || problem_->periodic) return;
  if (!problem_->free_start)
    newton_.frames().set_start(
        settled(*problem_->model, stage_.options, problem_->motors, problem_->start_q, workspace_));
  if (problem_->goal_q)
    newton_.frames().set_goal(
        settled(*problem_->model, stage_.options, problem_->motors, *problem_->goal_q, workspace_));
}

void Continuing::begin_stage() {
  stage_ = stage_at(*problem_, *settings_, smoothing_);
  stage_.options.time_step = newton_.frames().time_step();
  settle_ends();
  newton_.begin(stage_);
  stage_iterations_ = 0;
}

/// Extrapolates the last two stages linearly in the smoothing, if that lowers the cost: gaps of
/// loaded contacts are proportional to it, and Newton's method overshoots from gaps twice as large.
void Continuing::extrapolate(const Variables& last) {
  if (previous_.q.empty() || !settings_->continuation.extrapolate) return;
  const Model& model = *problem_->model;
  const double share = (last_good_ - smoothing_) / (previous_smoothing_ - last_good_);
  MatrixX step(model.nv(), newton_.frames().num_slots());
  VectorX difference(model.nv());
  for (std::size_t i = 0; i < last.q.size(); ++i) {
    configuration_difference(model, previous_.q[i], last.q[i], difference);
    step.col(static_cast<Eigen::Index>(i)) = share * difference;
  }
  const double cost = newton_.cost();
  newton_.frames().move(step, share * std::log(last.time_step / previous_.time_step));
  newton_.begin(stage_);
  if (newton_.cost() < cost) return;
  newton_.frames().set_variables(last);
  newton_.begin(stage_);
}

Continuing::Next Continuing::minimize(double tolerance, int most_steps) {
  for (int i = 0; i < most_steps; ++i) {
    if (static_cast<int>(history_.size()) >= settings_->max_iterations) return Next::kStop;
    const double before = newton_.cost();
    const Iteration step = newton_.iterate();
    Progress progress;
    progress.iteration = static_cast<int>(history_.size()) + 1;
    progress.stage = stages_;
    progress.smoothing = smoothing_;
    progress.penalty = stage_.penalty;
    progress.cost = newton_.cost();
    progress.unactuated = newton_.unactuated();
    progress.violation = newton_.violation();
    progress.seconds = wall_seconds() - start_seconds_;
    progress.step = step;
    history_.push_back(progress);
    ++stage_iterations_;
    if (settings_->watch) settings_->watch(progress, [this] { return result(Outcome::kStopped); });
    if (settings_->progress && !settings_->progress(progress)) {
      stopped_ = true;
      return Next::kStop;
    }
    if (!step.accepted || step.decrease < tolerance * before) break;
  }
  return Next::kGoOn;
}

Continuing::Next Continuing::run_stage(bool last) {
  for (int round = 0; round < settings_->continuation.rounds; ++round) {
    if (minimize(settings_->tolerance, settings_->stage_iterations) == Next::kStop)
      return Next::kStop;
    newton_.update_multipliers(settings_->continuation.multiplier_limit);
  }
  return last ? polish() : Next::kGoOn;
}

/// Restores feasibility by Gauss-Newton steps for the conditions alone. The multiplier iteration
/// converges slowly, since the Gauss-Newton matrix lacks the curvature of the conditions, but a few
/// such steps reach a feasible motion.
Continuing::Next Continuing::restore(double tolerance) {
  const Stage kept = stage_;
  stage_.restoring = true;
  stage_.penalty = std::max(stage_.penalty, kRestoringPenalty);
  newton_.begin(stage_, false);
  Next next = Next::kGoOn;
  for (int i = 0; i < kRestoringSteps && next == Next::kGoOn; ++i) {
    if (newton_.violation().max <= tolerance) break;
    next = minimize(0.0, 1);
    if (!history_.back().step.accepted) break;
  }
  stage_ = kept;
  newton_.begin(stage_, false);
  return next;
}

Continuing::Next Continuing::polish() {
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kPolishRounds; ++round) {
    const double violation = newton_.violation().max;
    if (violation <= settings_->violation_tolerance) break;
    const Variables kept = newton_.frames().variables();
    if (restore(settings_->violation_tolerance) == Next::kStop) return Next::kStop;
    if (newton_.violation().max <= settings_->violation_tolerance) break;
    // The restoration got stuck: continue with multipliers from the motion before it.
    newton_.frames().set_variables(kept);
    if (violation > kSlow * before) stage_.penalty *= kSteeper;
    before = violation;
    newton_.begin(stage_);
    if (minimize(kExact * settings_->tolerance, settings_->stage_iterations) == Next::kStop)
      return Next::kStop;
    newton_.update_multipliers(settings_->continuation.multiplier_limit);
  }
  return Next::kGoOn;
}

/// Cost without conditions.
double Continuing::objective() const {
  const VectorX costs = newton_.cost_by_term();
  double sum = 0.0;
  for (std::size_t i = 0; i < problem_->terms.size(); ++i)
    if (!problem_->terms[i].condition) sum += costs[static_cast<Eigen::Index>(i)];
  return sum;
}

bool Continuing::has_got_worse(const Spread& found, double objective) const {
  if (stages_ == 0 || (refused_in_row_ >= kPatience && smoothing_ > kFormed)) return false;
  if (found.mean > std::max(kWorse, kWorseRatio * last_mean_)) return true;
  if (smoothing_ >= kFormed) return false;
  const bool ran_out = stage_iterations_ >= settings_->stage_iterations;
  return objective > (ran_out ? kDearer : kMuchDearer) * last_objective_;
}

Result Continuing::run() {
  const Outcome outcome = go();
  Result out = result(outcome);
  out.history = std::move(history_);
  return out;
}

Outcome Continuing::go() {
  const double end = end_of(*problem_, *settings_);
  const Continuation& c = settings_->continuation;
  for (;;) {
    const Variables kept = newton_.frames().variables();
    const std::vector<VectorX> kept_multipliers = newton_.multipliers();
    const Stage kept_stage = stage_;
    begin_stage();
    extrapolate(kept);
    const bool last = smoothing_ <= end;
    const Next next = run_stage(last);
    if (next == Next::kStop) {
      const bool done = last && newton_.violation().max <= settings_->violation_tolerance;
      return stopped_ ? Outcome::kStopped : done ? Outcome::kConverged : Outcome::kIterations;
    }
    const Spread found = newton_.violation();
    const double costs = objective();
    if (has_got_worse(found, costs)) {
      ++refused_;
      const bool hopeless = ++refused_in_row_ >= kMostRefused || factor_ <= kLeastFactor;
      newton_.frames().set_variables(kept);
      newton_.set_multipliers(kept_multipliers);
      stage_ = kept_stage;
      newton_.restore_penalty(kept_stage.penalty);
      newton_.set_damping(1.0);
      factor_ = std::sqrt(factor_);
      if (hopeless) {
        smoothing_ = last_good_;
        newton_.begin(stage_);
        return Outcome::kInfeasible;
      }
      smoothing_ = last_good_ / factor_;
      continue;
    }
    if (refused_in_row_ >= kPatience) factor_ = c.factor;
    refused_in_row_ = 0;
    ++stages_;
    if (settings_->stage_done) settings_->stage_done(result(Outcome::kStopped));
    last_mean_ = found.mean;
    last_objective_ = costs;
    if (stages_ > 1) {
      previous_ = kept;
      previous_smoothing_ = last_good_;
    }
    last_good_ = smoothing_;
    if (last) break;
    if (stage_iterations_ <= settings_->stage_iterations / 2)
      factor_ = std::min(c.max_factor, 1.3 * factor_);
    const double by = smoothing_ <= kUnseen ? c.hard_factor : factor_;
    smoothing_ = smoothing_ / by < 1.01 * end ? end : smoothing_ / by;
    if (smoothing_ < kHard && last_good_ > 1.01 * kHard) smoothing_ = std::max(kHard, end);
  }
  const bool feasible = newton_.violation().max <= settings_->violation_tolerance;
  return feasible ? Outcome::kConverged : Outcome::kInfeasible;
}

Result Continuing::result(Outcome outcome) const {
  Result out;
  out.outcome = outcome;
  out.q = newton_.frames().all();
  const Model& model = *problem_->model;
  for (int t = 0; t <= problem_->steps; ++t) {
    VectorX v(model.nv());
    configuration_difference(model, newton_.frames().at(t - 1), newton_.frames().at(t), v);
    out.v.push_back(v / newton_.frames().time_step());
  }
  for (int t = 0; t < problem_->steps; ++t)
    out.applied_force.push_back(newton_.values()[static_cast<std::size_t>(t)].applied_force);
  out.cost_by_term = newton_.cost_by_term();
  out.cost = objective();
  out.unactuated = newton_.unactuated();
  out.violation = newton_.violation();
  out.smoothing = smoothing_;
  out.options = stage_.options;
  out.options.time_step = newton_.frames().time_step();
  out.options.push_deep = problem_->options.push_deep;
  out.iterations = static_cast<int>(history_.size());
  out.stages = stages_;
  out.refused_stages = refused_;
  out.seconds = wall_seconds() - start_seconds_;
  return out;
}

}  // namespace counterpoint::optimization
