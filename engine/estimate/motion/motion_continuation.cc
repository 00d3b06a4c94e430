#include "counterpoint/engine/estimate/motion/motion_continuation.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "counterpoint/engine/optimize/terms/evaluator.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

constexpr double kFactor = 2.0;       ///< initial ratio of the smoothings of two stages
constexpr double kLeastFactor = 1.1;  ///< smaller ratios are not tried
constexpr double kSofter = 1.8;       ///< minimum ratio of smoothing for ContinuationResult::softer
constexpr double kDearer = 1.2;       ///< a stage that raises the cost by more than this factor is
                                      ///< rejected
/// Above this smoothing [m] contacts are still forming, and the cost may rise.
constexpr double kFormed = 1e-3;

/// Parameters converge slowly: tolerance of their stage, relative to the usual one.
constexpr double kParameterTolerance = 0.3;
/// The laws have no effect if the final ones change the cost of the first stage's motion by less
/// than this fraction.
constexpr double kUntouched = 1e-6;

/// An accepted stage.
struct Accepted {
  MotionPoint point;
  double smoothing = 0.0, cost = kInfinity;
};

/// Extrapolates the last two stages linearly in the smoothing: gaps of loaded contacts are
/// proportional to it.
MotionPoint extrapolated(const Model& model, const Accepted& before, const Accepted& last,
                         double smoothing) {
  const double share = (smoothing - last.smoothing) / (last.smoothing - before.smoothing);
  MotionPoint out = last.point;
  VectorX difference(model.nv());
  for (std::size_t t = 0; t < out.q.size(); ++t) {
    configuration_difference(model, before.point.q[t], last.point.q[t], difference);
    integrate_configuration(model, last.point.q[t], difference, share, out.q[t]);
  }
  return out;
}

}  // namespace

SimulationOptions stage_options(const MotionProblem& problem, double smoothing) {
  optimization::Problem steps;
  steps.model = &problem.model;
  steps.options = problem.options;
  optimization::Settings settings;
  settings.continuation.end = smoothing;
  settings.continuation.limits_below = 1.0;  // otherwise a joint at its limit would need a motor
                                             // force
  return optimization::stage_at(steps, settings, smoothing).options;
}

ContinuationResult continue_motion(const MotionProblem& problem,
                                   const MotionContinuation& continuation, MotionFit& fit) {
  ContinuationResult result;
  std::optional<Accepted> before, last;
  std::vector<Accepted> stages;  // all accepted stages but the last
  MotionPoint start = fit.point();
  double smoothing = continuation.start, factor = kFactor;
  for (;;) {
    const SimulationOptions options = stage_options(problem, smoothing);
    fit.begin(options, start);
    if (before) {
      const double cost = fit.cost();
      fit.begin(options, extrapolated(problem.model, *before, *last, smoothing));
      if (!(fit.cost() < cost)) fit.begin(options, start);
    }
    result.steps +=
        fit.minimize(continuation.most_steps, continuation.tolerance, continuation.stop);
    if (last && fit.cost() > kDearer * last->cost && smoothing <= kFormed) {
      factor = std::sqrt(factor);
      if (factor < kLeastFactor) {
        fit.begin(stage_options(problem, last->smoothing), last->point);
        break;
      }
      start = last->point;
      smoothing = std::max(continuation.end, last->smoothing / factor);
      continue;
    }
    before = std::move(last);
    if (before) stages.push_back(*before);
    last = Accepted{fit.point(), smoothing, fit.cost()};
    if (!before && smoothing > continuation.end) {
      const SimulationOptions end = stage_options(problem, continuation.end);
      fit.begin(end, last->point);
      result.untouched = std::abs(fit.cost() - last->cost) <= kUntouched * last->cost;
      if (result.untouched) {
        last->smoothing = continuation.end;
        break;
      }
      fit.begin(options, last->point);
    }
    if (smoothing <= continuation.end || (continuation.stop && continuation.stop())) break;
    start = last->point;
    smoothing = std::max(continuation.end, smoothing / factor);
  }
  result.smoothing = last->smoothing;
  result.hardest = last->point;
  while (!stages.empty() && stages.back().smoothing < kSofter * last->smoothing) stages.pop_back();
  if (!stages.empty()) {
    result.softer = stages.back().point;
    result.softer_smoothing = stages.back().smoothing;
  }
  if (!problem.parameters.empty()) {  // unknown places are meaningless while contacts reach far
    fit.free_parameters(true);
    result.steps += fit.minimize(continuation.most_steps,
                                 kParameterTolerance * continuation.tolerance, continuation.stop);
  }
  result.cost = fit.cost();
  return result;
}

}  // namespace counterpoint::estimation
