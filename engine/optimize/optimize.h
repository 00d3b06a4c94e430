// Trajectory optimization through contact with positions as the only unknowns: contact times and
// places are found, not given (docs/guide/trajectory-optimization.md).
//
//   Result result = optimize(problem, frames, settings);
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/progress.h"
#include "counterpoint/engine/optimize/verify.h"
#include "counterpoint/engine/step_derivatives.h"

namespace counterpoint::optimization {

struct Stage;  // terms/evaluator.h

/// How smoothing falls: from far-reaching soft contacts, through which forces are found, to those
/// of the problem's own options.
struct Continuation {
  double start = 0.1;         ///< smoothing [m] of the first stage
  std::optional<double> end;  ///< of the last; none: that of the problem's options
  /// The smoothing [m] to go on from, where a run was stopped.
  std::optional<double> resume_at;
  double factor = 2.0;        ///< from stage to stage, at first
  double max_factor = 2.0;    ///< while stages need few iterations
  double hard_factor = 10.0;  ///< below 2e-9 m
  /// Compliance falls with smoothing [1/m], no lower than the problem's own: with stiff laws that
  /// reach far Newton's method overshoots into a wall.
  double compliance_per_metre = 10.0;
  /// Contacts exist up to so many times the smoothing, if that is more than the margin of the
  /// problem's options: what is to be pushed from afar has to be within it.
  double margin_per_smoothing = 0.0;
  /// Down to this smoothing [m] an overlap is recovered in one step, at any speed; from there to
  /// 1e-6 m both come to those of the problem's options.
  double quick_recovery_above = 3e-5;
  /// A stage starts from the line through the ends of the last two, where that is better.
  bool extrapolate = true;
  double limits_below = 1e-4;                      ///< joint limits act from this smoothing [m] on
  double penalty_start = 10.0, penalty_end = 1e4;  ///< of conditions, the latter from 1e-6 m on
  int rounds = 2;                                  ///< of minimization and multipliers a stage
  double multiplier_limit = 0.03;  ///< multipliers move only where conditions are this near
};

/// One accepted or refused Newton step, as told while it runs.
struct Progress {
  int iteration = 0;  ///< counted over all stages
  int stage = 0;
  double smoothing = 0.0;  ///< [m]
  double penalty = 0.0;
  double cost = 0.0;
  Spread unactuated;     ///< scene weights
  Spread violation;      ///< of all conditions
  double seconds = 0.0;  ///< since the start
  Iteration step;
};

enum class Outcome {
  kConverged,   ///< conditions hold to violation_tolerance at the last smoothing
  kInfeasible,  ///< the last stage ended with conditions farther off
  kIterations,  ///< max_iterations
  kStopped,     ///< by progress()
};
const char* outcome_name(Outcome outcome);

struct Result {
  Outcome outcome = Outcome::kInfeasible;
  std::vector<VectorX> q;              ///< frames 0 ... N
  std::vector<VectorX> v;              ///< their velocities, of frame 0 too
  std::vector<VectorX> applied_force;  ///< N
  double cost = 0.0;                   ///< conditions left out
  VectorX cost_by_term;
  Spread unactuated, violation;
  double smoothing = 0.0;     ///< of the last stage [m]
  SimulationOptions options;  ///< of the last stage
  int iterations = 0;         ///< Newton steps
  int stages = 0, refused_stages = 0;
  std::vector<Progress> history;
  double seconds = 0.0;
};

struct Settings {
  int threads = 0;            ///< 0: one a core
  int max_iterations = 600;   ///< Newton steps of all stages
  int stage_iterations = 40;  ///< of one minimization
  double tolerance = 1e-3;    ///< of the cost: a minimization ends where a step lowers it by less
  double violation_tolerance = 1e-5;  ///< of conditions, at the end
  Continuation continuation;
  DerivativeMethod derivatives = DerivativeMethod::kAnalytic;
  /// Called after every Newton step; false: stop, and return the motion as it is.
  std::function<bool(const Progress&)> progress;
  /// Called at the end of every stage with the motion so far, its history left out.
  std::function<void(const Result&)> stage_done;
};

/// Finds a motion. start: frames q_0 ... q_N to begin with (straight_line, an earlier result).
/// @throws InputError as check_problem, Frames.
Result optimize(const Problem& problem, const std::vector<VectorX>& start,
                const Settings& settings = {});

/// The stage of the continuation at a smoothing [m].
Stage stage_at(const Problem& problem, const Settings& settings, double smoothing);

}  // namespace counterpoint::optimization
