#include "counterpoint/engine/estimate/motion_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/motion/motion_deviations.h"
#include "counterpoint/engine/estimate/motion/motion_intervals.h"
#include "counterpoint/engine/estimate/motion/motion_priors.h"
#include "counterpoint/engine/estimate/motion/motion_result.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::estimation {
namespace {

/// Half-power frequency of the low-pass filter that gives the start of the search [Hz].
constexpr double kStartCutoff = 10.0;
/// Errors are slow if, after one soft stage for white errors, a quarter of the rows has a product
/// of cost ratio and unexplained force [weights of the tree] above kSlow. Impacts, which soft
/// contacts do not explain either, affect fewer rows. (White errors left 0.12 to 0.33, slow ones
/// 0.95 and more: docs/decisions/identification.md.)
constexpr double kSlow = 0.6;
constexpr double kQuarter = 0.75;
/// Errors are also slow if the final estimate for white errors leaves a quarter of the rows with a
/// cost ratio above kWhite (fewer rows may be impacts that the scene cannot reproduce, such as
/// bounces), or a quarter of the coordinates with a residual autocorrelation above kCorrelated
/// (white errors leave up to 0.4).
constexpr double kWhite = 4.0, kCorrelated = 0.6;
/// If the first start reaches this cost ratio, the second is not tried.
constexpr double kGood = 1.35;
/// The kind of errors is judged from this number of consecutive rows, those with most motion.
constexpr int kJudged = 80;
constexpr int kJudgingSteps = 40;
constexpr double kJudgingTolerance = 3e-3;
/// Rows estimated at a time, and additional rows on either side that are estimated with them.
constexpr int kRows = 1000, kOverlap = 40;
/// A motion of this engine leaves at most this unexplained force [weights of the tree].
constexpr double kOwn = 1e-7;

/// Arguments that are the same for all parts of a recording.
struct Task {
  const Scene& scene;
  const ColumnMap& map;
  const MotionEstimateOptions& options;
  std::vector<ContactSum> sums;
};

/// A problem and its solution.
struct Solved {
  std::unique_ptr<MotionProblem> problem;
  std::unique_ptr<MotionFit> fit;
  ContinuationResult result;
  bool learned = false;  ///< the deviations were learned from the recording
};

VectorX position_deviation(const MotionProblem& problem) {
  return problem.position_weight.rowwise().maxCoeff().cwiseInverse();
}

/// Marks the coordinates without a given standard deviation of noise.
std::vector<char> unknown_noise(const ColumnMap& map, int nv) {
  std::vector<char> out;
  for (const double known : given(map.position_deviation, nv)) out.push_back(!std::isfinite(known));
  return out;
}

/// Returns the value that a quarter of the values exceed.
double upper_quartile(std::vector<double> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(kQuarter * values.size());
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Start of the search: the low-passed recording.
MotionPoint start_of(const MotionProblem& problem, const RecordedMotion& recorded,
                     const MotionPriors& priors) {
  const double cutoff = priors.cutoff > 0.0 ? priors.cutoff : kStartCutoff;
  return {low_pass(problem.model, recorded.frames, recorded.h(), cutoff),
          VectorX::Zero(problem.num_parameters())};
}

/// Hardens the contacts stage by stage. Until then a convex sensor loss is used: with contact
/// forces that start at zero, a redescending loss would reject measured joint forces as outliers.
ContinuationResult harden(const MotionContinuation& continuation, MotionProblem& problem,
                          MotionFit& fit) {
  problem.convex_sensor_loss = true;
  ContinuationResult result = continue_motion(problem, continuation, fit);
  problem.convex_sensor_loss = false;
  if (problem.sensors.empty()) return result;
  fit.begin(fit.options(), fit.point());
  result.steps += fit.minimize(continuation.most_steps, continuation.tolerance, continuation.stop);
  result.cost = fit.cost();
  return result;
}

/// Tells the recorded motion, and those that the fit goes through, to MotionEstimateOptions::watch.
void watch(const MotionEstimateOptions& options, const RecordedMotion& recorded,
           const SimulationOptions& laws, MotionFit& fit) {
  const double start = recorded.time.front();
  options.watch({std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN(),
                 start, laws, recorded.frames});
  fit.watch([&options, &fit, start] {
    options.watch({fit.cost(), fit.measurement_ratio(), start, fit.options(), fit.point().q});
  });
}

/// Estimates the motion from each start of the priors until one is good: first from the low-passed
/// recording, which blurs impacts, then from the recorded rows.
Solved solve(const Task& task, const RecordedMotion& recorded, const MotionPriors& priors) {
  Solved best;
  best.problem = std::make_unique<MotionProblem>(motion_problem(task.scene, recorded, priors));
  MotionProblem& problem = *best.problem;
  MotionPoint start = start_of(problem, recorded, priors);
  int steps = 0;
  for (const double smoothing : priors.smoothing_starts) {
    auto fit = std::make_unique<MotionFit>(problem, start, task.options.threads);
    const MotionContinuation continuation{.start = std::max(smoothing, priors.smoothing_end),
                                          .end = priors.smoothing_end,
                                          .stop = task.options.stop};
    if (task.options.watch) watch(task.options, recorded, stage_options(problem, smoothing), *fit);
    const ContinuationResult result = harden(continuation, problem, *fit);
    steps += result.steps;
    if (result.untouched && only_smoothness_tells(problem)) {
      steps +=
          learn_deviations(unknown_noise(task.map, problem.nv()), task.options.stop, problem, *fit);
      best.fit = std::move(fit);
      best.result = result;
      best.learned = true;
      break;
    }
    const double ratio = fit->measurement_ratio();
    if (!best.fit || result.cost < best.result.cost) {
      best.fit = std::move(fit);
      best.result = result;
    }
    if (ratio <= kGood || (task.options.stop && task.options.stop())) break;
    start.q = recorded.frames;
  }
  best.result.steps = steps;
  return best;
}

MotionEstimate told(const Task& task, const RecordedMotion& recorded, Solved& solved) {
  MotionEstimate out = empty_estimate(task.scene.model, recorded.time, task.sums);
  set_motion(task.scene.model, solved.fit->point().q, recorded.h(), out);
  out.smoothing = solved.result.smoothing;
  if (task.options.stop && task.options.stop()) {
    set_forces_alone(*solved.problem, *solved.fit, out);
    return out;
  }
  set_forces(*solved.problem, *solved.fit, out);
  widen_by_smoothing(*solved.problem, solved.result, out);
  widen_by_residuals(out);
  widen_by_timing(out);
  return out;
}

/// Returns the kJudged consecutive rows with most motion.
RecordedMotion busiest(const Model& model, const RecordedMotion& recorded) {
  if (recorded.rows() <= kJudged) return recorded;
  const VectorX moved = steps_of(model, recorded.frames)
                            .cwiseProduct(recorded.measured.leftCols(recorded.rows() - 1))
                            .colwise()
                            .norm()
                            .transpose();
  int first = 0;
  double most = -1.0;
  for (int row = 0; row + kJudged <= recorded.rows(); row += kJudged / 3) {
    const double sum = moved.segment(row, kJudged - 1).sum();
    if (sum > most) first = row;
    most = std::max(most, sum);
  }
  return part(recorded, first, kJudged);
}

/// Explains the recording as an exact motion of this engine, by inverse dynamics at every row.
/// Returns false if it is none.
bool explain_own(const Task& task, const Recording& recording, const RecordedMotion& recorded,
                 MotionEstimate& out) {
  const Model& model = task.scene.model;
  const VectorX weights = optimization::unactuated_weights(model, optimization::motors_of(model));
  if (recorded.resampled || !task.map.sensors.empty() || weights.isZero(0.0) ||
      recording.v.isZero(0.0))
    return false;
  SimulationOptions options = task.scene.options;
  options.time_step = recorded.h();
  if (options.integrator == Integrator::kRungeKutta4) return false;
  Workspace workspace(model);
  Inverse inverse;
  for (int row = 0; row + 1 < recorded.rows(); ++row) {
    step_inverse(model, options, recording.q.col(row), recording.v.col(row),
                 recording.q.col(row + 1), recording.v.col(row + 1), Input(), workspace, inverse);
    if (inverse.fault.any() ||
        !(inverse.applied_force.cwiseProduct(weights).cwiseAbs().maxCoeff() <= kOwn))
      return false;
    set_inverse(model, inverse, row, out);
    set_sums(model, row, nullptr, out);
  }
  out.q = recording.q;
  out.v = recording.v;
  return true;
}

/// Returns whether the errors are slow, judged by the rows with most motion. `steps`: Newton steps
/// used. False if the scene has no motor: then a full estimate is as fast.
bool far_from_white(const Task& task, const RecordedMotion& recorded, int& steps) {
  const Model& model = task.scene.model;
  const std::vector<char> motors = optimization::motors_of(model);
  const VectorX weights = optimization::unactuated_weights(model, motors);
  const auto count = std::count(motors.begin(), motors.end(), 0);
  if (weights.isZero(0.0) || count == model.nv()) return false;
  const RecordedMotion rows = busiest(model, recorded);
  const MotionPriors priors = white_priors(task.scene, task.map, rows);
  const MotionProblem problem = motion_problem(task.scene, rows, priors);
  const MotionPoint start = start_of(problem, rows, priors);
  MotionFit fit(problem, start, task.options.threads);
  fit.begin(stage_options(problem, priors.smoothing_starts.front()), start);
  steps = fit.minimize(kJudgingSteps, kJudgingTolerance, task.options.stop);
  std::vector<double> products;
  for (int t = 1; t + 1 < rows.rows(); ++t) {
    const VectorX& force = fit.instants()[static_cast<std::size_t>(t)].force;
    products.push_back(fit.measurement_ratio(t) *
                       force.cwiseProduct(weights).cwiseAbs().maxCoeff());
  }
  return upper_quartile(std::move(products)) > kSlow;
}

/// Returns whether the residuals of the estimate are consistent with white errors.
bool leaves_white(const RecordedMotion& rows, const MotionProblem& problem, const MotionFit& fit) {
  std::vector<double> ratios, correlations;
  MatrixX q(problem.model.nq(), problem.frames());
  for (int t = 0; t < problem.frames(); ++t) {
    ratios.push_back(fit.measurement_ratio(t));
    q.col(t) = fit.point().q[static_cast<std::size_t>(t)];
  }
  if (upper_quartile(std::move(ratios)) > kWhite) return false;
  for (const double one : residual_correlation(problem.model, rows, q, position_deviation(problem)))
    if (std::isfinite(one)) correlations.push_back(one);
  return correlations.empty() || upper_quartile(std::move(correlations)) <= kCorrelated;
}

/// Estimates all rows, one part after the other. Returns false, with an incomplete result, if
/// `judged` is set and the first part shows that the errors are not white.
bool explain_parts(const Task& task, const RecordedMotion& recorded, RecordingErrors errors,
                   bool judged, MotionEstimate& out) {
  VectorX change;  // learned from the previous part
  const auto priors_of = errors == RecordingErrors::kSlow ? slow_priors : white_priors;
  for (int first = 0; first < recorded.rows(); first += kRows) {
    const int begin = std::max(0, first - kOverlap);
    int end = std::min(recorded.rows(), first + kRows + kOverlap);
    if (recorded.rows() - end < kRows / 2) end = recorded.rows();
    const RecordedMotion rows = part(recorded, begin, end - begin);
    MotionPriors priors = priors_of(task.scene, task.map, rows);
    if (change.size() > 0) {
      priors.change = change;
      priors.position = out.position_deviation;
    }
    Solved solved = solve(task, rows, priors);
    out.newton_steps += solved.result.steps;
    const bool stopped = task.options.stop && task.options.stop();
    if (judged && first == 0 && !stopped && !leaves_white(rows, *solved.problem, *solved.fit))
      return false;
    append(told(task, rows, solved), begin, first - begin, out);
    out.position_deviation = position_deviation(*solved.problem);
    if (solved.learned) change = solved.problem->change_weight.cwiseInverse();
    if (end == recorded.rows() || stopped) break;
  }
  return true;
}

}  // namespace

MotionEstimate estimate_motion(const Scene& scene, const ColumnMap& map, const Recording& recording,
                               const MotionEstimateOptions& options) {
  const double start = wall_seconds();
  const RecordedMotion recorded = prepare(scene.model, map, recording);
  const Task task{scene, map, options, with_links(scene.model, options.sums)};
  MotionEstimate out = empty_estimate(scene.model, recorded.time, task.sums);
  out.file = recording.file;
  if (!options.errors && explain_own(task, recording, recorded, out)) {
    out.errors = RecordingErrors::kNone;
    out.position_deviation = VectorX::Zero(scene.model.nv());
  } else {
    out = empty_estimate(scene.model, recorded.time, task.sums);
    out.file = recording.file;
    const bool judged = !options.errors;
    if (judged && far_from_white(task, recorded, out.newton_steps))
      out.errors = RecordingErrors::kSlow;
    else
      out.errors = options.errors.value_or(RecordingErrors::kWhite);
    const bool white = out.errors == RecordingErrors::kWhite;
    if (!explain_parts(task, recorded, out.errors, judged && white, out)) {
      out.errors = RecordingErrors::kSlow;
      explain_parts(task, recorded, out.errors, false, out);
    }
  }
  out.recorded.resize(scene.model.nq(), recorded.rows());
  for (int row = 0; row < recorded.rows(); ++row)
    out.recorded.col(row) = recorded.frames[static_cast<std::size_t>(row)];
  leave_out_untouched(options.sums.size(), out);
  summarize(scene.model, recorded, out);
  out.stopped = options.stop && options.stop();
  out.seconds = wall_seconds() - start;
  return out;
}

}  // namespace counterpoint::estimation
