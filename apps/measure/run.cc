#include "measure/run.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/clocks.h"

namespace counterpoint::apps {
namespace {

bool stops(const RunHooks& hooks, RunTally& tally) {
  tally.interrupted = hooks.stop && hooks.stop();
  return tally.interrupted || tally.wall_seconds > tally.wall_limit;
}

/// Times one call of the simulator: adds wall time to the tally, returns processor time in
/// `seconds` [s].
template <class Step>
auto timed(RunTally& tally, double& seconds, Step step) {
  const double start = wall_seconds();
  const double busy = thread_seconds();
  auto report = step();
  seconds = thread_seconds() - busy;
  tally.wall_seconds += wall_seconds() - start;
  return report;
}

std::optional<FailedStep> run_fixed(Simulator& simulator, AppliedInputs& inputs,
                                    const RunHooks& hooks, RunTally& tally) {
  const double h = simulator.options().time_step;
  const long steps = std::lround(std::ceil(simulator.options().duration / h - 1e-6));
  State before;
  for (long k = 0; k < steps && !stops(hooks, tally); ++k) {
    inputs.set(simulator);
    if (hooks.step) before = simulator.state();
    const double start_time = simulator.state().time;
    double seconds = 0.0;
    const StepReport step = timed(tally, seconds, [&] { return simulator.step(); });
    tally.add(step, start_time, seconds);
    if (!step.succeeded()) {
      ++tally.failures;
      return FailedStep{k, simulator.state().time, step};
    }
    if (hooks.step) hooks.step(before, simulator.input(), h, simulator.state(), step);
    if (hooks.forces) hooks.forces(start_time);
    if (tally.watch) tally.watch->after_step(h, simulator.state());
    if (hooks.progress) hooks.progress(static_cast<double>(k + 1) / static_cast<double>(steps));
  }
  return {};
}

std::optional<FailedStep> run_controlled(Simulator& simulator, AppliedInputs& inputs,
                                         const RunHooks& hooks, RunTally& tally) {
  const SimulationOptions& options = simulator.options();
  const double start_time = simulator.state().time, end = start_time + options.duration;
  State before;
  while (simulator.state().time < end && !stops(hooks, tally)) {
    inputs.set(simulator);
    before = simulator.state();
    const double landing = std::min(next_landing(*options.step_control, before.time, end),
                                    inputs.next_change(before.time));
    double seconds = 0.0;
    const ControlledReport step =
        timed(tally, seconds, [&] { return simulator.step_controlled(landing); });
    tally.add(step.first, before.time, 0.5 * seconds);
    tally.add(step.second, before.time + 0.5 * step.step, 0.5 * seconds);
    tally.control.add(step);
    if (!step.succeeded()) {
      ++tally.failures;
      return FailedStep{tally.steps - 1, before.time, step.second};
    }
    if (hooks.step) {
      hooks.step(before, simulator.input(), 0.5 * step.step, simulator.middle(), step.first);
      hooks.step(simulator.middle(), simulator.input(), 0.5 * step.step, simulator.state(),
                 step.second);
    }
    if (hooks.forces) hooks.forces(simulator.middle().time);
    if (tally.watch) {
      tally.watch->after_step(0.5 * step.step, simulator.middle());
      tally.watch->after_step(0.5 * step.step, simulator.state());
    }
    if (hooks.progress)
      hooks.progress((simulator.state().time - start_time) /
                     std::max(options.duration, before.time - start_time));
  }
  return {};
}

}  // namespace

void RunTally::add(const StepReport& step, double start_time, double seconds) {
  if (step.softening.unfinished()) {
    if (unfinished_steps++ == 0) unfinished_first = start_time;
    unfinished_residual = std::max(unfinished_residual, step.residual);
  }
  if (step.softening.softens()) {
    if (softened_steps++ == 0) softened_first = start_time;
    softening_max = std::max(softening_max, std::abs(step.softening.factor));
  }
  if (step.fault.any() && stays_open++ == 0) {
    stays_open_time = start_time;
    stays_open_first = step.fault;
  }
  statistics.add(step.newton_iterations, seconds);
  ++steps;
  contacts += step.contacts;
  sleeping += step.sleeping_bodies;
  newton_iterations += step.newton_iterations;
  newton_iterations_max = std::max<long>(newton_iterations_max, step.newton_iterations);
  end_penetration = step.max_penetration;
  max_penetration = std::max(max_penetration, step.max_penetration);
}

void RunTally::fill(double simulated_seconds, Json& out) const {
  const double count = static_cast<double>(std::max(steps, 1L));
  out["steps"] = steps;
  out["simulated_seconds"] = simulated_seconds;
  out["wall_seconds"] = wall_seconds;
  out["realtime_factor"] = wall_seconds > 0.0 ? simulated_seconds / wall_seconds : 0.0;
  out["contacts_mean"] = static_cast<double>(contacts) / count;
  out["sleeping_bodies_mean"] = static_cast<double>(sleeping) / count;
  out["newton_iterations_mean"] = static_cast<double>(newton_iterations) / count;
  out["newton_iterations_max"] = newton_iterations_max;
  statistics.fill(out);
  out["solver_failures"] = failures;
  out["softened_steps"] = softened_steps;
  out["softening_max"] = softening_max;
  if (softened_steps > 0) out["softened_first_time_s"] = softened_first;
  out["unfinished_steps"] = unfinished_steps;
  out["unfinished_residual_max"] = unfinished_residual;
  if (unfinished_steps > 0) out["unfinished_first_time_s"] = unfinished_first;
  out["stays_open_reports"] = stays_open;
  if (stays_open > 0) out["stays_open_first_time_s"] = stays_open_time;
  out["max_penetration_m"] = max_penetration;
  out["end_penetration_m"] = end_penetration;
  if (watch) watch->fill(out);
}

std::optional<FailedStep> run_simulation(Simulator& simulator, AppliedInputs& inputs,
                                         const RunHooks& hooks, RunTally& tally) {
  const auto run = simulator.options().step_control ? run_controlled : run_fixed;
  return run(simulator, inputs, hooks, tally);
}

}  // namespace counterpoint::apps
