#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// The next length is kSafety times the one that the error allows, within kMaxShrink and kMaxGrowth
/// of the last; a rejected one falls to kBisect of itself or less.
constexpr double kSafety = 0.9, kMaxGrowth = 10.0, kMaxShrink = 0.1, kBisect = 0.5;
/// Factor after a failed step, whose error is unknown.
constexpr double kAfterFailure = 0.25;
/// Time from the end of a step to the impact ahead, as a share of the step that contains the
/// impact: it falls into the middle of that step's first half.
constexpr double kAim = 0.25;
/// Differences below this share of the largest coordinate are rounding.
constexpr double kRoundings = 16.0 * kEpsilon;
/// Height at which contacts rest above each other, in smoothing lengths; it is the same at any
/// step.
constexpr double kSmoothings = 16.0;

bool given_is_at_fault(const StepReport& report) {
  return report.fault.kind >= FaultKind::kTime && report.fault.kind <= FaultKind::kInternalState;
}

/// The action of contacts and limits in a step.
struct Push {
  double speed = 0.0;  ///< sum of their changes of speed [m/s, rad/s]
  bool landed =
      false;  ///< one with an open gap at the start changed a speed by more than the tolerance
};

Push find_push(const SimulationOptions& options, const ConstraintSet& constraints,
               const ContactSolution& solution) {
  Push push;
  if (constraints.empty()) return push;
  const contact::Problem& problem = solution.problem;
  const double tolerance = options.step_control->tolerance;
  const auto num_pairs = static_cast<int>(constraints.pairs.size());
  // A row of a speed limit has no gap.
  const bool limits_have_gaps = !options.effects.has(Effect::kVelocityLimits);
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const contact::Law& law = problem.law(c);
    if (!contact::is_one_sided(law.type)) continue;
    const double speed = std::abs(solution.impulse[problem.first_row(c)]) * law.regularizer /
                         options.contact.compliance;
    push.speed += speed;
    const double gap = c < num_pairs      ? constraints.contacts[static_cast<size_t>(c)].gap
                       : limits_have_gaps ? law.bias[0] * options.time_step
                                          : 0.0;
    push.landed = push.landed || (speed > tolerance && gap > tolerance * options.time_step &&
                                  gap > touching_gap(options.contact));
  }
  return push;
}

/// Time [s] from the start of the last step until its first contact closes faster than `speed`
/// [m/s]. It is a lower bound, as if gravity drove the contact; infinity if there is none.
double time_to_contact(const Model& model, double speed, const ConstraintSet& constraints,
                       const Kinematics& at) {
  const double gravity = model.gravity().norm();
  double first = kInfinity;
  for (size_t i = 0; i < constraints.contacts.size(); ++i) {
    const double gap = constraints.contacts[i].gap;
    const double closing = -relative_velocity(constraints.pairs[i], at, at.V)[0];
    if (!(gap > 0.0)) continue;
    const double square = closing * closing + 2.0 * gravity * gap;
    if (closing <= 0.0 || square <= speed * speed) continue;
    first = std::min(first, 2.0 * gap / (closing + std::sqrt(square)));
  }
  return first;
}

/// A trial of one step length: two half steps, and a whole step to compare them with.
class Trial {
 public:
  Trial(const Model& model, const SimulationOptions& options, const contact::Settings& settings,
        const Input& input, Workspace& workspace, ControlledReport& report)
      : model_(model),
        options_(options),
        control_(*options.step_control),
        settings_(settings),
        input_(input),
        workspace_(workspace),
        ws_(workspace.impl()),
        report_(report) {}

  /// Fills the report, except the fields that follow from the error.
  void run(const State& state, double h, State& middle, State& next) {
    report_.step = h;
    report_.error = kInfinity;
    switched_ = constrained_ = false;
    ws_.control.touched.assign(static_cast<size_t>(model_.num_trees()), 0);
    if (!step(state, 0.5 * h, middle, report_.first)) {
      report_.second = report_.first;
      return;
    }
    const Push first = find_push(options_, ws_.constraints, ws_.solution);
    if (!step(middle, 0.5 * h, next, report_.second)) return;
    const Push second = find_push(options_, ws_.constraints, ws_.solution);
    switched_ = first.landed || second.landed ||
                std::abs(first.speed - second.speed) >
                    std::max(0.5 * (first.speed + second.speed), control_.tolerance);
    StepReport whole;
    if (step(state, h, ws_.control.whole, whole)) measure(h, next);
  }

  bool switched() const { return switched_; }
  int coordinate() const { return coordinate_; }

  int order() const {
    if (options_.integrator == Integrator::kSemiImplicitEuler) return 1;
    if (options_.integrator == Integrator::kRungeKutta4) return 4;
    return constrained_ ? 1 : 2;
  }

 private:
  bool step(const State& from, double h, State& to, StepReport& report) {
    options_.time_step = h;
    ++report_.evaluations;
    report = step_forward(model_, options_, settings_, from, input_, workspace_, to);
    constrained_ = constrained_ || !ws_.constraints.empty();
    for_each_constraint(model_, ws_.constraints, [&](int a, int b) {
      for (const int tree : {a, b})
        if (tree >= 0) ws_.control.touched[static_cast<size_t>(tree)] = 1;
    });
    return report.succeeded();
  }

  /// Sets the error: the distance of the whole step from the halves, over the allowed distance.
  void measure(double h, const State& next) {
    StepControlScratch& scratch = ws_.control;
    scratch.q.resize(model_.nv());
    configuration_difference(model_, scratch.whole.q, next.q, scratch.q);
    const double rounding_q = kRoundings * std::max(1.0, next.q.lpNorm<Eigen::Infinity>()) +
                              (constrained_ ? kSmoothings * options_.contact.smoothing : 0.0);
    const double rounding_v = kRoundings * next.v.lpNorm<Eigen::Infinity>();
    const double share = (std::exp2(order()) - 1.0) * h;
    report_.error = 0.0;
    for (int t = 0; t < model_.num_trees(); ++t) {
      const Tree& tree = model_.trees()[t];
      // Velocities under constraints are those that close a gap within the step, or contain half a
      // step of falling (midpoint rule): an error of order h that does not accumulate.
      const bool velocities = scratch.touched[static_cast<size_t>(t)] == 0;
      for (int i = tree.v_begin; i < tree.v_end; ++i) {
        double off = std::abs(scratch.q[i]) - rounding_q;
        if (velocities) off = std::max(off, std::abs(next.v[i] - scratch.whole.v[i]) - rounding_v);
        const double error =
            off /
            (share * (control_.tolerance + control_.relative_tolerance * std::abs(next.v[i])));
        if (!(error > report_.error)) continue;
        report_.error = error;
        coordinate_ = i;
      }
    }
  }

  const Model& model_;
  SimulationOptions options_;  ///< with time_step as it is tried
  const StepControlOptions& control_;
  const contact::Settings& settings_;
  const Input& input_;
  Workspace& workspace_;
  Workspace::Impl& ws_;
  ControlledReport& report_;
  bool switched_ = false, constrained_ = false;
  int coordinate_ = 0;
};

/// Factor to the next step length: the error of a step grows as h^(order + 1), the allowed one as
/// h.
double factor(double error, int order) {
  if (!(error < kInfinity)) return kAfterFailure;
  return std::clamp(kSafety * std::pow(error, -1.0 / order), kMaxShrink, kMaxGrowth);
}

/// The length [s] of a step that ends shortly before the impact in a step of h, or of half a step.
/// to_contact: time to the first contact [s].
double nearer(double h, double impact_step, double to_contact) {
  const double before = to_contact - kAim * impact_step;
  return before > 0.0 && before < kBisect * h ? before : kBisect * h;
}

void fail_missed(const Trial& trial, const Model& model, double min_step,
                 ControlledReport& report) {
  report.second.fault =
      velocity_fault(FaultKind::kTolerance, model, trial.coordinate(), report.error);
  report.second.fault.bound = min_step;
  report.second.status = status_of(report.second.fault);
}

}  // namespace

ControlledReport step_controlled(const Model& model, const SimulationOptions& options,
                                 const contact::Settings& settings, const State& state,
                                 const Input& input, double until, Workspace& workspace,
                                 double& proposal, State& middle, State& next) {
  if (!options.step_control)
    throw InputError("a controlled step needs SimulationOptions::step_control");
  if (active_effects(workspace.impl().called, options.effects).has(Effect::kPrescribed))
    throw InputError(
        "step control splits steps, and prescribed coordinates are those at the end of a whole "
        "one: leave out step_control");
  const StepControlOptions& control = *options.step_control;
  const double left = until - state.time;
  if (!(left > 0.0)) throw InputError("a controlled step must end later than it begins");
  // A smaller step would be lost in the rounding of the time.
  const double min_step = std::max(control.min_step, 64.0 * kEpsilon * std::abs(until));
  const double impact_step = std::max(control.event_tolerance, min_step);
  const double wanted = std::clamp(proposal, min_step, control.max_step);
  // The last two steps share the rest of the time, so that neither is very short.
  double h = left <= wanted ? left : std::min(wanted, 0.5 * left);

  ControlledReport report;
  Trial trial(model, options, settings, input, workspace, report);
  for (;; ++report.rejected) {
    trial.run(state, h, middle, next);
    const bool failed = !report.second.succeeded();
    if (failed && (h <= min_step || given_is_at_fault(report.second))) return report;
    report.impact = !failed && trial.switched();
    if (report.impact ? h <= impact_step : report.error <= 1.0) break;
    report.missed = h <= min_step;
    if (report.missed && control.strict) fail_missed(trial, model, min_step, report);
    if (report.missed) break;
    const auto to_contact = [&] {
      const Workspace::Impl& ws = workspace.impl();
      return time_to_contact(model, control.tolerance, ws.constraints, ws.start.kinematics());
    };
    h = report.impact
            ? std::max(nearer(h, impact_step, to_contact()), impact_step)
            : std::max(h * std::min(factor(report.error, trial.order()), kBisect), min_step);
  }
  if (!report.succeeded()) return report;
  if (report.step == left) next.time = until;
  const double growth = report.impact || report.missed ? 1.0 : factor(report.error, trial.order());
  const double cap = report.rejected > 0 ? 1.0 : kMaxGrowth;
  const double allowed = report.step * std::clamp(growth, kMaxShrink, cap);
  // A step cut short by `until` leaves the wanted length as it was.
  const bool cut = report.rejected == 0 && report.step < wanted;
  proposal = std::min(control.max_step, cut ? std::max(wanted, allowed) : allowed);
  return report;
}

double next_landing(const StepControlOptions& control, double time, double end) {
  if (!(control.interval > 0.0)) return end;
  constexpr double kSlack = 1e-9;  // times are rounded
  const double k = std::floor(time / control.interval + kSlack) + 1.0;
  const double landing = k * control.interval;
  return landing < end - kSlack * control.interval ? landing : end;
}

}  // namespace counterpoint
