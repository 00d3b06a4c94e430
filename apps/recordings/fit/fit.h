// Least squares over groups of residuals (one a recording), within bounds, from many starts.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/spatial.h"
#include "tasks/task_list.h"

namespace counterpoint::apps {

/// One vector a group, of the same sizes in every call.
using GroupedResiduals = std::vector<VectorX>;

/// Residuals and their derivatives: a matrix a group, a column a parameter.
struct LinearizedResiduals {
  GroupedResiduals residuals;
  std::vector<MatrixX> jacobians;
};

struct FitProblem {
  std::function<GroupedResiduals(const VectorX& values)> residuals;
  /// Exact derivatives by the parameters that `exact` marks, the columns of the others not looked
  /// at; none where they are not known. May be empty.
  std::function<std::optional<LinearizedResiduals>(const VectorX& values)> linearize;
  std::vector<char> exact;
  /// The residuals are rough: differences over wide steps find the way, exact derivatives finish.
  bool rough = false;
  VectorX lower, upper, start;
  std::vector<char> logarithmic;  ///< by parameter: looked for by its logarithm
};

struct FitOptions {
  int samples = 64;     ///< points tried beside the start before any is refined
  int refined = 3;      ///< of these the best are refined by Levenberg-Marquardt
  int max_rounds = 15;  ///< of Levenberg-Marquardt, each
  /// Groups far off count less: Cauchy's loss, its scale the median of the groups at the best
  /// point tried. Else plain squares.
  bool robust = true;
  int bootstrap = 0;  ///< refits to groups drawn anew; 0: intervals from derivatives only
  /// Exact derivatives where the problem has them; else differences of all.
  bool exact = true;
  /// Step of the central differences, as a share of the range between the bounds.
  double difference = 1e-3;
  /// Told by the threads at work, one at a time, in evaluations.
  std::function<void(int done, int total)> progress = {};
  /// Asked as the search goes on: true ends it with the best found so far.
  std::function<bool()> stop = {};
  /// Runs the lists of tasks that a fit is made of; by default in this thread. `residuals`
  /// and `linearize` are then called by all threads that it has.
  tasks::ListRunner run = tasks::run_here;
  /// Of all that the problem and these options depend on, for `run`.
  std::uint64_t fingerprint = 0;
};

/// The lists of a fit, one after the other: points tried, the best of them refined, refits to groups
/// drawn anew. The last one's name.
const char* last_fit_list(const FitOptions& options);

struct Interval {
  double lower = 0.0, upper = 0.0;
};

struct FittedParameter {
  double value = 0.0;
  std::optional<Interval> interval;   ///< 95 %; none where the residuals do not depend on it
  std::optional<Interval> bootstrap;  ///< 95 %, percentiles of the refits
  bool at_bound = false;
};

struct Fit {
  std::vector<FittedParameter> parameters;
  MatrixX correlation;      ///< of the estimates, by the derivatives
  double start_cost = 0.0;  ///< sum over groups of the loss, at the start
  double cost = 0.0;        ///< at the values found
  double loss_scale = 0.0;  ///< of Cauchy's loss, in the units of the residuals; 0: squares
  int evaluations = 0;      ///< of all residuals
  int linearizations = 0;   ///< of all residuals with their exact derivatives
  std::vector<double> refined_costs;  ///< of the points refined, best first
  bool stopped = false;               ///< by FitOptions::stop: intervals may be missing
  VectorX values() const;
};

/// The same input gives the same bits, whatever runs its tasks. @throws InputError where start or bounds are no numbers, or
/// there are fewer residuals than parameters.
Fit fit(const FitProblem& problem, const FitOptions& options);

}  // namespace counterpoint::apps
