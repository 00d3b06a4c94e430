#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control.h"
#include "counterpoint/engine/optimize/control/plan.h"
#include "counterpoint/engine/optimize/newton/newton.h"
#include "counterpoint/engine/optimize/reference.h"
#include "counterpoint/engine/optimize/settle.h"
#include "counterpoint/engine/optimize/terms/effort_limits.h"

namespace counterpoint::optimization {
namespace {

/// Damping of a plan that starts from rest, relative to the diagonal.
constexpr double kFirstDamping = 1e-3;

Stage stage_of(const Problem& problem, const PlannerSettings& planner) {
  Settings settings;
  settings.continuation.start = planner.smoothing;
  settings.continuation.compliance_per_metre = planner.compliance_per_metre;
  settings.continuation.margin_per_smoothing = planner.margin_per_smoothing;
  settings.continuation.contact_damping = planner.contact_damping;
  Stage stage = stage_at(problem, settings, planner.smoothing);
  stage.penalty = planner.penalty;
  return stage;
}

/// Returns the problem in which motors, not servos, move the joints.
Problem checked(Problem problem) {
  check_problem(problem);
  if (problem.periodic || problem.goal_q || problem.free_start)
    throw InputError(
        "control: the problem must not be periodic, its goal not fixed, and its start not free");
  for (const Term& term : problem.terms)
    if (!term.active.empty())
      throw InputError("control: " + term.name + ": 'when' chooses frames of a motion that stays");
  if (problem.duration)
    throw InputError("control: a plan looks ahead by a fixed duration; remove 'duration'");
  problem.options.effects.set(Effect::kServos, false);
  return problem;
}

std::vector<VectorX> at_rest(const Problem& problem) {
  return std::vector<VectorX>(static_cast<std::size_t>(problem.steps) + 1, problem.start_q);
}

/// Height [m] (nq, zero elsewhere) by which floating trees stand higher in the plan than in the
/// world: smoothed contacts carry a body at a distance, or let it sink.
VectorX lift_of(const Problem& problem, const Stage& stage) {
  const Model& model = *problem.model;
  VectorX lift = VectorX::Zero(model.nq());
  if (!problem.settle) return lift;
  Workspace workspace(model);
  const auto standing = [&](const SimulationOptions& options) {
    return settled(model, options, problem.motors, problem.start_q, workspace);
  };
  const VectorX apart = standing(stage.options) - standing(problem.options);
  for (const Tree& tree : model.trees()) {
    const Body& base = model.body(tree.body_begin);
    if (base.joint_type == JointType::kFloating) lift[base.q_index + 2] = apart[base.q_index + 2];
  }
  return lift;
}

}  // namespace

struct Planner::Impl {
  Impl(const Problem& given, const PlannerSettings& planner)
      : problem(checked(given)),
        settings(planner),
        stage(stage_of(problem, planner)),
        newton(problem, at_rest(problem), planner.threads),
        lift(lift_of(problem, stage)),
        shifted(newton.frames().variables()),
        plan{problem.model,
             problem.h(),
             0.0,
             at_rest(problem),
             std::vector<VectorX>(static_cast<std::size_t>(problem.steps), problem.start_v),
             problem.start_v},
        q(problem.start_q),
        start(problem.start_q),
        start_v(problem.start_v),
        difference(problem.start_v),
        wanted_q(problem.start_q),
        wanted_v(problem.start_v),
        scratch_v(problem.start_v),
        dynamics(model()),
        mass(model().nv(), model().nv()),
        disturbance(VectorX::Zero(model().nv())) {
    newton.set_least_damping(planner.least_damping);
    newton.begin(stage);
  }

  const Model& model() const { return *problem.model; }
  int last() const { return problem.steps; }

  void hold(const VectorX& pose) {
    for (VectorX& slot : shifted.q) slot = pose;
    newton.frames().set_variables(shifted);
    newton.set_damping(kFirstDamping);
  }

  /// Moves the frames on by `duration` [s]; beyond the last frame the plan holds it.
  void shift(double duration) {
    const double h = problem.h();
    for (std::size_t i = 0; i < shifted.q.size(); ++i) {
      const double s = static_cast<double>(i + 1) + duration / h;
      const int k = static_cast<int>(std::min(std::floor(s), static_cast<double>(last())));
      newton.frames().read(k, q);
      shifted.q[i] = q;
      if (k == last()) continue;
      newton.frames().read(k + 1, next);
      configuration_difference(model(), q, next, difference);
      integrate_configuration(model(), q, difference, s - k, shifted.q[i]);
    }
    newton.frames().set_variables(shifted);
  }

  /// Updates the estimate of the force without a motor (nv) that the plan does not know, from how
  /// the state (q, v) differs from the one predicted by the last plan:
  ///
  ///   r = M ((v - v_0) / t - (v_1 - v_0) / h),   t the time since the last plan,
  ///
  /// v_0 and v_1 the velocities of its frames 0 and 1. The plan counts the estimate, which comes to
  /// rest when plan and world agree (offset-free predictive control, Pannocchia and Rawlings 2003).
  void estimate_disturbance(double duration, const VectorX& at_q, const VectorX& at_v) {
    if (settings.disturbance_time == 0.0 || !(duration > 0.0)) return;
    dynamics.set_configuration(at_q);
    dynamics.mass_matrix(mass);
    plan.write_velocity(1, difference);
    difference = (at_v - plan.start_v) / duration - (difference - plan.start_v) / plan.h;
    const double share = -std::expm1(-duration / settings.disturbance_time);
    for (int k = 0; k < model().nv(); ++k)
      if (!problem.motors[static_cast<std::size_t>(k)])
        disturbance[k] +=
            share * (mass.row(k).dot(difference) + model().armature()[k] * difference[k]);
    for (Term& term : problem.terms)
      if (term.quantity == Quantity::kUnactuatedForce) term.target = disturbance;
  }

  void move_targets(double now) {
    set_targets(problem, now);
    for (Term& term : problem.terms)
      if (term.offset.size() > 0)
        integrate_configuration(model(), start, term.offset, 1.0, term.target);
  }

  /// Tries `count` Gauss-Newton steps; those that do not lower the cost count, so that every replan
  /// takes the same time.
  void iterate(int count, ReplanReport& report) {
    for (int left = count; left > 0;) {
      left -= newton.iterate(std::min(left, Damping::kMaxTrials)).trials;
      ++report.iterations;
    }
    report.cost = newton.cost();
    report.violation = newton.violation();
  }

  Problem problem;
  PlannerSettings settings;
  Stage stage;
  Newton newton;
  VectorX lift;
  Variables shifted;  ///< variables of the shifted plan
  Plan plan;          ///< the one in use
  VectorX q, next, start;
  VectorX start_v;          ///< velocity of frame 0 of the next plan
  double start_time = 0.0;  ///< its time [s]
  VectorX difference;
  VectorX wanted_q, wanted_v, scratch_v;  ///< scratch of sample() and force()
  Dynamics dynamics;
  MatrixX mass;
  VectorX disturbance;  ///< estimated force without a motor (nv) [N, N m]
  bool planned = false, lost = false;
};

Planner::Planner(const Problem& problem, const PlannerSettings& settings)
    : impl_(std::make_unique<Impl>(problem, settings)) {}
Planner::~Planner() = default;
Planner::Planner(Planner&&) noexcept = default;
Planner& Planner::operator=(Planner&&) noexcept = default;

ReplanReport Planner::prepare(double time, const VectorX& q, const VectorX& v) {
  Impl& p = *impl_;
  ReplanReport report;
  if (p.planned) p.estimate_disturbance(time - p.plan.time, q, v);
  p.start = q + p.lift;
  p.start_v = v;
  if (p.planned) {
    p.shift(time - p.start_time);
  } else {
    p.hold(p.start);
  }
  p.start_time = time;
  p.newton.frames().set_start(p.start, v);
  p.move_targets(time);
  p.iterate(p.planned ? p.settings.iterations : p.settings.first_iterations, report);
  const bool lost = !(report.violation.mean <= p.settings.lost_above);
  if (lost && p.planned && !p.lost) {
    p.hold(p.start);
    p.iterate(p.settings.first_iterations, report);
    report.restarted = true;
  }
  p.lost = lost;
  p.planned = true;
  return report;
}

void Planner::adopt() {
  Impl& p = *impl_;
  p.plan.time = p.start_time;
  p.plan.start_v = p.start_v;
  for (int t = 0; t <= p.last(); ++t) {
    const auto i = static_cast<std::size_t>(t);
    p.newton.frames().read(t, p.plan.frames[i]);
    p.plan.frames[i] -= p.lift;
    if (t < p.last()) p.plan.force[i] = p.newton.values()[i].applied_force;
  }
}

ReplanReport Planner::replan(double time, const VectorX& q, const VectorX& v) {
  const ReplanReport report = prepare(time, q, v);
  adopt();
  return report;
}

void Planner::forget() {
  impl_->planned = impl_->lost = false;
  impl_->disturbance.setZero();
}

const std::vector<VectorX>& Planner::frames() const { return impl_->plan.frames; }

double Planner::time() const { return impl_->plan.time; }

const Problem& Planner::problem() const { return impl_->problem; }

void Planner::set_target(const std::string& term, const VectorX& target) {
  for (Term& known : impl_->problem.terms) {
    if (known.name != term) continue;
    if (known.quantity == Quantity::kOrientation)
      throw InputError(fmt::format("control: '{}' is an orientation, not a target", term));
    const int size = target_size(impl_->model(), known.quantity);
    if (target.size() != size)
      throw InputError(fmt::format("control: the target of '{}' has {} entries, {} are given", term,
                                   size, target.size()));
    known.target = target;
    known.offset.resize(0);
    known.targets.clear();
    known.reference.reset();
    return;
  }
  throw InputError(fmt::format("control: the problem has no term '{}'", term));
}

void Planner::sample(double time, VectorX& q, VectorX& v, VectorX& force) const {
  impl_->plan.sample(time, q, v, force, impl_->scratch_v);
}

void Planner::force(double time, const FeedbackGains& gains, const VectorX& q, const VectorX& v,
                    VectorX& out) {
  Impl& p = *impl_;
  sample(time, p.wanted_q, p.wanted_v, out);
  VectorX& difference = p.scratch_v;
  configuration_difference(p.model(), q, p.wanted_q, difference);
  out += gains.stiffness.cwiseProduct(difference);
  out += gains.damping.cwiseProduct(p.wanted_v - v);
  clamp_to_effort_limits(p.model(), out);
  for (int k = 0; k < out.size(); ++k)
    if (!p.problem.motors[static_cast<std::size_t>(k)]) out[k] = 0.0;
}

}  // namespace counterpoint::optimization
