// A simulation from start to end with its counters, for `simulate` and `sweep`.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "counterpoint/engine/simulator.h"
#include "input/applied_inputs.h"
#include "measure/run_watch.h"
#include "measure/step_statistics.h"
#include "report/failure.h"
#include "report/step_control_report.h"

namespace counterpoint::apps {

/// Counters over the steps of a run.
struct RunTally {
  ControlTally control;
  StepStatistics statistics;
  long softened_steps = 0;
  double softening_max = 1.0, softened_first = 0.0;
  long unfinished_steps = 0;
  double unfinished_residual = 0.0, unfinished_first = 0.0;
  long stays_open = 0;           ///< reports of closures and mimic joints that stay open
  double stays_open_time = 0.0;  ///< time of the first such report [s]
  Fault stays_open_first;
  long steps = 0, contacts = 0, sleeping = 0, newton_iterations = 0, newton_iterations_max = 0,
       failures = 0;
  double max_penetration = 0.0, end_penetration = 0.0, wall_seconds = 0.0;
  double wall_limit = std::numeric_limits<double>::infinity();
  std::unique_ptr<RunWatch> watch;  ///< may be null, because watching a step costs time
  bool interrupted = false;         ///< RunHooks::stop returned true

  /// Adds a step; `seconds`: its processor time.
  void add(const StepReport& step, double start_time, double seconds);
  /// Writes the counters into the report of `simulate` (docs/reference/json-reports.md).
  void fill(double simulated_seconds, Json& out) const;
};

/// Callbacks of a run; each may be empty.
struct RunHooks {
  /// Called after a successful step with its start, input, length [s] and end.
  std::function<void(const State& before, const Input&, double h, const State& after,
                     const StepReport&)>
      step;
  /// Called after a step that started at a time [s], while last_forces() belongs to it; for
  /// controlled steps after the second half only.
  std::function<void(double start_time)> forces;
  std::function<void(double share)> progress;  ///< share of the duration done, 0 ... 1
  std::function<bool()> stop;                  ///< returning true stops before the next step
};

/// Steps the simulator to the end of its duration or to the first failed step: with its time step,
/// or with step control if its options have it. Every half of a controlled step is a step for the
/// `step` hook.
std::optional<FailedStep> run_simulation(Simulator& simulator, AppliedInputs& inputs,
                                         const RunHooks& hooks, RunTally& tally);

}  // namespace counterpoint::apps
