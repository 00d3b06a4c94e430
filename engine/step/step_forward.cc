#include <algorithm>
#include <limits>
#include <string>

#include "counterpoint/engine/constraints/contact_memory.h"
#include "counterpoint/engine/diagnosis/failure_cause.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/midpoint.h"
#include "counterpoint/engine/step/runge_kutta.h"
#include "counterpoint/engine/step/step_constraints.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {

Workspace::Workspace(const Model& model) : impl_(std::make_unique<Impl>(model)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

const EffectCounts& Workspace::effect_counts() const { return impl_->counts; }

std::span<const int> Workspace::free_trees() const { return impl_->free_groups.trees(); }

void measure_phases(Workspace& workspace, PhaseTimes* times) { workspace.impl().times = times; }

void check_time_step(double h) {
  if (!(h > 0.0 && h < std::numeric_limits<double>::infinity()))
    throw InputError("the time step of a step must be positive, it is " + std::to_string(h) + " s");
}

namespace {

/// M (w+ - w) = h (n + u - D w+) + J' f,  q+ = q (+) h w+, from ws.start.
void step_euler(const StepArguments& step, Workspace::Impl& ws, State& next, StepReport& report) {
  const Model& model = step.model;
  const State& state = step.state;
  const double h = step.h();
  compute_free_velocity(step, ws, next.v, report);
  if (report.succeeded()) solve_constraints(step, ws, next.v, report);
  const bool constrained = !ws.constraints.empty();
  const VectorX& displacement =
      report.succeeded() && constrained ? correct_overlaps(step, ws, next.v, report) : next.v;
  ws.sleepers.find_islands(model, ws.constraints);
  next.q = state.q;
  next.time = state.time + h;
  for (const BodyRange& bodies : ws.sleepers.awake())
    integrate_configuration(model, state.q, displacement, h, bodies, next.q);
  if (constrained)
    ws.sleepers.hold_still(model, h, ws.finder.radii(), ws.data, state, displacement, next);
  if (!report.succeeded() || ws.free_groups.groups().empty()) return;
  const bool displaced = &displacement != &next.v;
  if (displaced) integrate_configuration(model, state.q, next.v, h, ws.q_reached);
  ws.free_groups.correct(step.context(), step.input, displaced ? ws.q_reached : next.q, next);
}

/// The forces of the constraints of a step go with the state that it led to.
void remember(const StepArguments& step, Workspace::Impl& ws, State& next) {
  if (ws.constraints.empty() && ws.sleepers.num_sleeping_bodies() == 0) {
    next.memory.clear();
  } else {
    remember_impulses(step.model, {ws.constraints, ws.data, ws.problem, step.h()}, ws.impulse,
                      ws.sleepers.idle_bodies(), step.state.memory, next.memory);
  }
  if (step.effects.has(Effect::kTautLinks)) ws.taut_links.remember(step.h(), next.memory);
}

/// What a step was given goes before what came of it.
void blame_given(const StepArguments& step, Workspace::Impl& ws, StepReport& report) {
  const Fault given = ws.check.of_given(step.model, step.state, step.input);
  if (!given.any()) return;
  report.fault = given;
  report.status = status_of(given);
}

/// Looks at what came out of a step.
void check_result(const StepArguments& step, const State& next, Workspace::Impl& ws,
                  StepReport& report) {
  const auto& [model, options, settings, state, input, effects] = step;
  if (ws.check.accepts(options.max_speed, next)) return;
  report.fault = ws.check.of_result(model, options.max_speed, next);
  report.status = status_of(report.fault);
  if (report.fault.kind != FaultKind::kSpeed) return;
  const double reach = ws.check.reach()[static_cast<size_t>(report.fault.coordinate)];
  report.fault.cause =
      speed_cause(model, step.h(), report.fault, reach, state, input, next, ws.data, ws.velocity);
}

bool may_sleep(const StepArguments& step) {
  return step.options.integrator == Integrator::kSemiImplicitEuler &&
         step.effects.has(Effect::kSleeping);
}

void choose_awake(const StepArguments& step, Workspace::Impl& ws) {
  if (!may_sleep(step)) return ws.sleepers.wake_all(step.model);
  ws.counts.add(Effect::kSleeping);
  ws.sleepers.begin(step.model, step.options, step.settings, step.state, step.input);
}

/// Trees at rest but for this step: what a fast body may strike had its contacts looked for in a
/// wider space, and softer laws are of one step.
void keep_awake(const Model& model, const StepReport& report, Workspace::Impl& ws) {
  for (int t = 0; t < model.num_trees(); ++t) {
    const bool softened = report.softening.any() && ws.softened_trees.holds(t, -1);
    if (softened || ws.finder.in_reach_of_fast()[t]) ws.sleepers.keep_awake(t);
  }
  for (const TautLink& link : ws.taut_links.links())
    ws.sleepers.keep_awake(model.body(link.body).tree);
}

/// Checks what came of it, and keeps what the next step starts from.
void conclude(const StepArguments& step, Workspace::Impl& ws, State& next, StepReport& report) {
  if (report.succeeded()) check_result(step, next, ws, report);
  if (!report.succeeded()) blame_given(step, ws, report);
  report.contacts = static_cast<int>(ws.constraints.contacts.size());
  report.constraint_rows = ws.constraints.empty() ? 0 : ws.problem.num_rows();
  report.sleeping_bodies = ws.sleepers.num_sleeping_bodies();
  report.max_penetration = std::max(ws.constraints.max_penetration, ws.sleepers.max_penetration());
  if (report.succeeded()) remember(step, ws, next);
  if (may_sleep(step) && report.succeeded()) {
    ws.sleepers.end(step.model, step.state, step.input, ws.constraints, next);
    keep_awake(step.model, report, ws);
  } else {
    ws.sleepers.forget();
  }
}

/// From the state to `next`, of what is awake.
void advance(const StepArguments& step, Workspace::Impl& ws, State& next, StepReport& report) {
  const StepStart& start = prepare_step(step.context(), ws);
  ws.constraints = start.constraints();
  switch (step.options.integrator) {
    case Integrator::kSemiImplicitEuler:
      return step_euler(step, ws, next, report);
    case Integrator::kImplicitMidpoint:
      return step_midpoint(step, ws, next, report);
    case Integrator::kRungeKutta4:
      return step_runge_kutta(step, ws, next, report);
  }
}

/// The same with what a report of it needs, and all awake if softer laws are of all.
void advance_awake(const StepArguments& step, Workspace::Impl& ws, State& next,
                   StepReport& report) {
  report = {};
  report.softening = step.input.softening;
  advance(step, ws, next, report);
  // Softer laws of all trees are also of those that sleep, which came to rest with their own.
  const bool all_softened = report.softening.any() && report.softening.tree < 0;
  if (!all_softened || ws.sleepers.num_sleeping_bodies() == 0) return;
  ws.sleepers.wake_all(step.model);
  report = {};
  report.softening = step.input.softening;
  advance(step, ws, next, report);
}

/// How often a step is made again with more inertia of taut links: forces hardly depend on it.
constexpr int kMostTautened = 4;

/// From the state to `next`, with as much inertia of taut links as its forces ask for.
void advance_with_taut_links(const StepArguments& step, Workspace::Impl& ws, State& next,
                             StepReport& report) {
  const auto& [model, options, settings, state, input, effects] = step;
  TautLinks& taut = ws.taut_links;
  const bool on = effects.has(Effect::kTautLinks) && options.integrator != Integrator::kRungeKutta4;
  if (!input.taut_links.empty() || !on) {
    taut.set(input.taut_links);
  } else {
    ws.counts.add(Effect::kTautLinks);
    taut.recall(step.h(), state.memory);
  }
  const auto try_step = [&](const SimulationOptions& how) {
    const StepArguments slowed{taut.slowed(model), how, settings, state, input, effects};
    advance_awake(slowed, ws, next, report);
    if (report.succeeded() && on) find_taut_rates(slowed, next, ws);
  };
  try_step(options);
  const bool free = on && input.taut_links.empty();
  if (free && !report.succeeded() && options.integrator == Integrator::kImplicitMidpoint) {
    // Too fast for its iteration, nothing is known of forces.
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
                        Workspace& workspace,
                        State& next) {  // Parameters: what it depends on, one by one
  Workspace::Impl& ws = workspace.impl();
  const PhaseTimer timer(ws.times, &PhaseTimes::step);
  const EffectSet effects = active_effects(ws.called, options.effects);
  const StepArguments step{model, options, settings, state, input, effects};
  StepReport report;
  check_time_step(options.time_step);
  if (!ws.check.accepts(model, state, input)) {
    report.softening = input.softening;
    blame_given(step, ws, report);
    return report;
  }
  choose_awake(step, ws);
  advance_with_taut_links(step, ws, next, report);
  conclude(step, ws, next, report);
  return report;
}

}  // namespace counterpoint
