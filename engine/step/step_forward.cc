#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>

#include "counterpoint/engine/constraints/contact_memory.h"
#include "counterpoint/engine/diagnosis/failure_cause.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/forces/driven/closure_switches.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/midpoint.h"
#include "counterpoint/engine/step/runge_kutta.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "counterpoint/engine/step/taut_rates.h"

namespace counterpoint {

Workspace::Workspace(const Model& model) : impl_(std::make_unique<Impl>(model)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

const EffectCounts& Workspace::effect_counts() const { return impl_->counts; }

void Workspace::set_threads(int count) {
  if (count < 1) throw InputError(fmt::format("{} threads; a step needs 1 or more", count));
  impl_->pool = count > 1 ? std::make_unique<contact::ThreadPool>(count) : nullptr;
  impl_->solution.solver.use(impl_->pool.get());
  impl_->overlap_correction.use(impl_->pool.get());
}

std::span<const int> Workspace::free_trees() const { return impl_->free_groups.trees(); }

void measure_phases(Workspace& workspace, PhaseTimes* times) { workspace.impl().times = times; }

void check_time_step(double h) {
  if (!(h > 0.0 && h < std::numeric_limits<double>::infinity()))
    throw InputError("the time step of a step must be positive, it is " + std::to_string(h) + " s");
}

namespace {

void check_budget(const SimulationOptions& options, const contact::Settings& settings) {
  if (options.step_budget < 0)
    throw InputError(fmt::format("step_budget is {} Newton steps; 0 (none) or more is expected",
                                 options.step_budget));
  if (options.step_budget > 0 && settings.soften_after == 0)
    throw InputError(
        "step_budget lets steps end unfinished, and strict steps (soften_after 0) fail instead: "
        "leave one of them out");
}

/// The integrate stage: finds the islands and sets next.q and next.time by moving the awake bodies
/// from `state` by h times the displacement velocity (nv), except islands whose motion is lost in
/// rounding.
void integrate(const StageInput& in, const ConstraintSet& constraints,
               const std::vector<double>& radii, const VectorX& displacement, Sleepers& sleepers,
               State& next) {
  const auto& [model, options, settings, state, input, effects, z] = in.step;
  const double h = in.step.h();
  sleepers.find_islands(model, constraints);
  next.q = state.q;
  next.time = state.time + h;
  for (const BodyRange& bodies : sleepers.awake())
    integrate_configuration(model, state.q, displacement, h, bodies, next.q);
  if (!constraints.empty())
    sleepers.hold_still(model, h, radii, in.start.kinematics(), state, displacement, next);
}

/// Gives the free groups in `next` (q, v) the momentum that they must have. displacement: next.v
/// itself, or another vector where overlaps were corrected; then q_reached (nq, scratch) gets the
/// poses that next.v alone leads to.
void correct_free_groups(const StepArguments& step, const VectorX& displacement, FreeGroups& groups,
                         VectorX& q_reached, State& next) {
  if (groups.groups().empty()) return;
  const bool displaced = &displacement != &next.v;
  if (displaced) integrate_configuration(step.model, step.state.q, next.v, step.h(), q_reached);
  groups.correct(step.context(), step.input, displaced ? q_reached : next.q, next);
}

/// The prescribed motion of a step; null where it does not act.
PrescribedMotion* find_prescribed(const StepArguments& step, Workspace::Impl& ws) {
  if (!step.effects.has(Effect::kPrescribed)) return nullptr;
  ws.counts.add(Effect::kPrescribed);
  ws.prescribed.find(step.context(), step.input);
  return &ws.prescribed;
}

/// M (w+ - w) = h (n + u - D w+) + J' f,  q+ = q (+) h w+: the stages of a semi-implicit Euler
/// step.
void step_euler(const StepArguments& step, Workspace::Impl& ws, State& next, StepReport& report) {
  PrescribedMotion* prescribed = find_prescribed(step, ws);
  const StageInput in{step,      ws.start,   ws.sleepers,  ws.taut_links,
                      ws.counts, prescribed, ws.pool.get()};
  ConstraintStage constraints(in, ws.motion, ws.finder, ws.constraints, ws.solution, report);
  {
    const PhaseTimer timer(ws.times, &PhaseTimes::dynamics);
    ws.start.find_inertias(step.model, ws.sleepers.awake(), in.pool);
    find_free_velocity(in, ws.motion, ws.constraints, next.v, report);
  }
  if (report.succeeded()) {
    const PhaseTimer timer(ws.times, &PhaseTimes::constraints);
    constraints.solve(next.v);
  }
  const VectorX* displacement = &next.v;
  if (report.succeeded() && !ws.constraints.empty()) {
    const PhaseTimer timer(ws.times, &PhaseTimes::overlaps);
    displacement = &constraints.correct_overlaps(ws.overlap_correction, ws.displacement, next.v);
  }
  integrate(in, ws.constraints, ws.finder.radii(), *displacement, ws.sleepers, next);
  if (report.succeeded())
    correct_free_groups(step, *displacement, ws.free_groups, ws.q_reached, next);
  if (prescribed != nullptr) prescribed->set(step.model, next.q, next.v);
}

/// Stores the forces of the step's constraints in the state that it leads to.
void remember(const StepArguments& step, Workspace::Impl& ws, State& next) {
  if (ws.constraints.empty() && ws.sleepers.num_sleeping_bodies() == 0) {
    next.memory.clear();
  } else {
    remember_impulses(
        step.model, {ws.constraints, ws.start.kinematics(), ws.solution.problem, step.h()},
        ws.solution.impulse, ws.sleepers.sleep_mask(), step.state.memory, next.memory);
  }
  if (step.effects.has(Effect::kTautLinks)) ws.taut_links.remember(step.h(), next.memory);
}

/// If an argument was invalid, reports that instead of its consequences.
void report_invalid_input(const StepArguments& step, const StateCheck& check, StepReport& report) {
  const Fault given = check.of_given(step.model, step.state, step.input);
  if (!given.any()) return;
  report.fault = given;
  report.status = status_of(given);
}

/// Reports a state that is not finite or too fast.
void check_result(const StepArguments& step, const StateCheck& check, const State& next,
                  StepReport& report) {
  const auto& [model, options, settings, state, input, effects, z] = step;
  if (check.accepts(options.max_speed, next)) return;
  report.fault = check.of_result(model, options.max_speed, next);
  report.status = status_of(report.fault);
  if (report.fault.kind != FaultKind::kSpeed) return;
  const double reach = check.reach()[static_cast<size_t>(report.fault.coordinate)];
  report.fault.cause = speed_cause(model, step.h(), report.fault, reach, state, input, next);
}

bool may_sleep(const StepArguments& step) {
  return step.options.integrator == Integrator::kSemiImplicitEuler &&
         step.effects.has(Effect::kSleeping);
}

/// The wake stage: finds the trees that sleep through the step.
void choose_awake(const StepArguments& step, Sleepers& sleepers, EffectCounts& counts) {
  if (!may_sleep(step)) return sleepers.wake_all(step.model);
  counts.add(Effect::kSleeping);
  sleepers.begin(step.model, step.options, step.settings, step.state, step.input);
}

/// Keeps trees awake whose next step may differ from this one at an equal state: trees that a fast
/// body may reach (their contact search used a larger margin), and trees whose laws or inertias
/// were changed for this step only.
void keep_awake(const Model& model, const SoftenedTrees* softened_trees,
                std::span<const char> in_reach_of_fast, std::span<const TautLink> taut_links,
                Sleepers& sleepers) {
  for (int t = 0; t < model.num_trees(); ++t) {
    const bool softened = softened_trees != nullptr && softened_trees->holds(t, -1);
    if (softened || in_reach_of_fast[t]) sleepers.keep_awake(t);
  }
  for (const TautLink& link : taut_links) sleepers.keep_awake(model.body(link.body).tree);
}

/// Writes the internal states that the step leads to.
void advance_internal_states(const StepArguments& step, Workspace::Impl& ws, State& next) {
  next.z = step.z;
  if (!ws.constraints.closures.empty())
    break_closures(step.model, ws.constraints, ws.solution.problem, ws.solution.impulse, step.h(),
                   next.z);
  if (!step.effects.has(Effect::kActuators)) return;
  const bool midpoint = step.options.integrator == Integrator::kImplicitMidpoint;
  ws.actuators.conclude(step.context(), ws.start.tendons(), midpoint ? ws.midpoint.w_c : next.v,
                        ws.actuator_force, next.z);
}

/// The final stage: checks the result, and stores the impulses and sleeping trees that the next
/// step starts from.
void conclude(const StepArguments& step, Workspace::Impl& ws, State& next, StepReport& report) {
  if (report.succeeded()) check_result(step, ws.check, next, report);
  if (!report.succeeded()) report_invalid_input(step, ws.check, report);
  report.contacts = static_cast<int>(ws.constraints.contacts.size());
  report.constraint_rows = ws.constraints.empty() ? 0 : ws.solution.problem.num_rows();
  report.sleeping_bodies = ws.sleepers.num_sleeping_bodies();
  report.max_penetration = std::max(ws.constraints.max_penetration, ws.sleepers.max_penetration());
  if (report.succeeded()) advance_internal_states(step, ws, next);
  if (report.succeeded()) remember(step, ws, next);
  if (may_sleep(step) && report.succeeded()) {
    ws.sleepers.end(step.model, step.state, step.input, ws.constraints, next);
    if (report.softening.unfinished())
      ws.solution.softened_trees.find(step.model, ws.constraints, report.softening);
    keep_awake(step.model, report.softening.any() ? &ws.solution.softened_trees : nullptr,
               ws.finder.contacts().search().in_reach_of_fast(), ws.taut_links.links(),
               ws.sleepers);
  } else {
    ws.sleepers.forget();
  }
}

/// Finds the forces of actuators that act; returns the input of the step with their wrenches, and
/// adds the effect that lets these act.
const Input& actuate(const StepContext& at, const Input& given, Workspace::Impl& ws,
                     EffectSet& effects) {
  ws.counts.add(Effect::kActuators);
  ws.actuators.find(at, ws.start.kinematics(), ws.start.tendons(), ws.start.constraints(), given);
  ws.actuators.add_rows(at, ws.start.tendons(), ws.sleepers.sleep_mask(), ws.constraints);
  const std::span<const ExternalWrench> wrenches = ws.actuators.wrenches();
  if (wrenches.empty()) return given;
  ws.actuated = given;
  if (!effects.has(Effect::kExternalWrenches)) ws.actuated.wrenches.clear();
  ws.actuated.wrenches.insert(ws.actuated.wrenches.end(), wrenches.begin(), wrenches.end());
  effects.set(Effect::kExternalWrenches, true);
  return ws.actuated;
}

}  // namespace

StepArguments actuate(const StepArguments& step, Workspace::Impl& ws) {
  if (!step.effects.has(Effect::kActuators)) return step;
  EffectSet effects = step.effects;
  const Input& input = actuate(step.context(), step.input, ws, effects);
  return {step.model, step.options, step.settings, step.state, input, effects, step.z};
}

InverseArguments actuate(const InverseArguments& step, Workspace::Impl& ws) {
  if (!step.effects.has(Effect::kActuators)) return step;
  EffectSet effects = step.effects;
  const Input& known = actuate(step.context(), step.known, ws, effects);
  return {step.model,  step.options, step.q,  step.v, step.q_next,
          step.v_next, known,        effects, step.z, step.exact_q_next};
}

namespace {

/// Advances the awake trees from `state` to `next` with one of the integrators.
void advance(const StepArguments& given, Workspace::Impl& ws, State& next, StepReport& report) {
  report = {};
  if (given.input.softening.softens()) report.softening = given.input.softening;
  ws.constraints = prepare_step(given.context(), ws).constraints();
  const StepArguments step = actuate(given, ws);
  if (step.effects.has(Effect::kTendons))
    add_tendon_servos(step.context(), ws.start.tendons(), step.input, ws.constraints);
  if (step.effects.has(Effect::kPrescribed) &&
      step.options.integrator != Integrator::kSemiImplicitEuler)
    throw InputError(
        "prescribed motion needs the integrator semi_implicit_euler; choose it, or give the "
        "joints servos");
  switch (step.options.integrator) {
    case Integrator::kSemiImplicitEuler:
      return step_euler(step, ws, next, report);
    case Integrator::kImplicitMidpoint:
      return step_midpoint(step, ws, next, report);
    case Integrator::kRungeKutta4:
      return step_runge_kutta(step, ws, next, report);
  }
}

/// Advances the awake trees. A softening of all trees changes the laws of sleeping trees too, which
/// came to rest with their own: then all are woken and the step is done again.
void advance_awake(const StepArguments& step, Workspace::Impl& ws, State& next,
                   StepReport& report) {
  advance(step, ws, next, report);
  const bool all_softened = report.softening.any() && report.softening.tree < 0;
  if (!all_softened || ws.sleepers.num_sleeping_bodies() == 0) return;
  ws.sleepers.wake_all(step.model);
  advance(step, ws, next, report);
}

/// A step is repeated up to this number of times with more inertia of taut links: the forces hardly
/// depend on it.
constexpr int kMostTautened = 4;

/// Advances from `state` to `next` with as much inertia of taut links (taut_links.h) as the forces
/// of the step ask for.
void advance_with_taut_links(const StepArguments& step, Workspace::Impl& ws, State& next,
                             StepReport& report) {
  const SimulationOptions& options = step.options;
  const Input& input = step.input;
  TautLinks& taut = ws.taut_links;
  const bool on =
      step.effects.has(Effect::kTautLinks) && options.integrator != Integrator::kRungeKutta4;
  if (!input.taut_links.empty() || !on) {
    taut.set(input.taut_links);
  } else {
    ws.counts.add(Effect::kTautLinks);
    taut.recall(step.h(), step.state.memory);
  }
  const auto try_step = [&](const SimulationOptions& how) {
    const StepArguments slowed{
        taut.slowed(step.model), how, step.settings, step.state, input, step.effects, step.z};
    advance_awake(slowed, ws, next, report);
    if (report.succeeded() && on) find_taut_rates(slowed, next, ws);
  };
  try_step(options);
  const bool free = on && input.taut_links.empty();
  if (free && !report.succeeded() && options.integrator == Integrator::kImplicitMidpoint) {
    // Links too fast for the midpoint iteration leave no forces to judge by: an Euler step tells.
    SimulationOptions euler = options;
    euler.integrator = Integrator::kSemiImplicitEuler;
    const StepReport failed = report;
    try_step(euler);
    const bool more = report.succeeded() && taut.raise(step.h());
    report = failed;
    if (more) try_step(options);
  }
  for (int i = 0; free && i < kMostTautened && report.succeeded() && taut.raise(step.h()); ++i)
    try_step(options);
  for (const TautLink& link : taut.links()) {
    report.taut_links += link.factor > 1.0 ? 1 : 0;
    report.largest_inertia = std::max(report.largest_inertia, link.factor);
  }
}

}  // namespace

StepReport step_forward(const Model& model, const SimulationOptions& options,
                        const contact::Settings& settings, const State& state, const Input& input,
                        Workspace& workspace, State& next) {
  Workspace::Impl& ws = workspace.impl();
  const PhaseTimer timer(ws.times, &PhaseTimes::step);
  const EffectSet effects = active_effects(ws.called, options.effects);
  const StepArguments step{model, options, settings, state, input, effects, ws.z};
  StepReport report;
  check_time_step(options.time_step);
  check_budget(options, settings);
  if (!ws.check.accepts(model, state, input)) {
    report.softening = input.softening;
    report_invalid_input(step, ws.check, report);
    return report;
  }
  set_internal_states(model, effects, state.q, state.z, input, ws);
  choose_awake(step, ws.sleepers, ws.counts);
  advance_with_taut_links(step, ws, next, report);
  conclude(step, ws, next, report);
  return report;
}

}  // namespace counterpoint
