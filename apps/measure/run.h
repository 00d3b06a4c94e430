// A simulation from its start to its end, and what is counted on the way: of `simulate` and of
// `sweep`.
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

/// What is counted over the steps of a run.
struct RunTally {
  ControlTally control;
  StepStatistics statistics;
  long softened_steps = 0;
  double softening_max = 1.0, softened_first = 0.0;
  long stays_open = 0;           ///< reports of closures and mimic joints that do
  double stays_open_time = 0.0;  ///< of the first [s]
  Fault stays_open_first;
  long steps = 0, contacts = 0, sleeping = 0, newton_iterations = 0, newton_iterations_max = 0,
       failures = 0;
  double max_penetration = 0.0, end_penetration = 0.0, wall_seconds = 0.0;
  double wall_limit = std::numeric_limits<double>::infinity();
  std::unique_ptr<RunWatch> watch;  ///< may be none: it costs some time a step it looks at
  bool interrupted = false;         ///< RunHooks::stop said so

  /// `seconds`: processor time of the step.
  void add(const StepReport& step, double start_time, double seconds);
  /// Under their names in the report of `simulate` (docs/reference/json-reports.md).
  void fill(double simulated_seconds, Json& out) const;
};

/// What else is to be done; each may be empty.
struct RunHooks {
  /// A step that succeeded: from where, under what, how long [s], to where.
  std::function<void(const State& before, const Input&, double h, const State& after,
                     const StepReport&)>
      step;
  /// After a step that started at a time [s], while last_forces() are its own; of controlled steps
  /// after the second half.
  std::function<void(double start_time)> forces;
  std::function<void(double share)> progress;  ///< of the duration, 0 ... 1
  std::function<bool()> stop;                  ///< no further step is begun
};

/// Steps the simulator to the end of its duration, or to the first step that fails: by its time
/// step, or by step control where its options have it; every half of a controlled step is a step to
/// the hooks.
std::optional<FailedStep> run_simulation(Simulator& simulator, AppliedInputs& inputs,
                                         const RunHooks& hooks, RunTally& tally);

}  // namespace counterpoint::apps
