#include "counterpoint/engine/estimate/parameter_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "counterpoint/engine/estimate/fit/fit_spread.h"
#include "counterpoint/engine/estimate/fit/joint_fit.h"
#include "counterpoint/engine/estimate/identifiability.h"
#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/motion/motion_priors.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"
#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/engine/estimate/parameters/step_parameters.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Half-power frequency of the low-pass filter that gives the start of a motion [Hz].
constexpr double kBeginCutoff = 10.0;
/// Smoothing [m]. Each motion is first estimated alone, from both of these starts down to kJoined,
/// and the better result is kept. Then all motions are estimated jointly down to kHardEnd; the end
/// must be hard, since with soft contacts friction and inertia are off by a third.
constexpr double kNearBegin = 3e-3, kFarBegin = 1e-2, kJoined = 1e-3, kHardEnd = 5e-7;
constexpr double kStageFactor = 2.0;
/// Below this smoothing [m] the Cauchy loss is used, with a scale of kLoss standard deviations: the
/// scene cannot reproduce some impact rows.
constexpr double kLossBelow = 3e-4, kLoss = 3.0;
constexpr int kStageSteps = 40;
constexpr double kStageTolerance = 1e-3;
/// If the measurement cost ratio stays above kSure, the noise is larger than assumed: the search
/// restarts with larger standard deviations, up to kFigureRounds times.
constexpr double kSure = 3.0;
constexpr int kFigureRounds = 3;
/// Bounds of a sensor's constants [standard deviations of their priors].
constexpr double kMostDeviations = 10.0;

/// The parameters in the forms that the joint fit needs.
struct SearchedParameters {
  std::vector<StepParameter> steps;
  std::vector<SharedParameter> shared;
};

bool is_found_with_motion(ParameterKind kind) {
  if (is_inertial(kind)) return true;
  switch (kind) {
    case ParameterKind::kFriction:
    case ParameterKind::kTorsionalFriction:
    case ParameterKind::kRollingFriction:
    case ParameterKind::kDamping:
    case ParameterKind::kDryFriction:
    case ParameterKind::kBreakawayFriction:
    case ParameterKind::kStribeckSpeed:
    case ParameterKind::kArmature:
    case ParameterKind::kGravity:
    case ParameterKind::kHeight:
      return true;
    default:
      return false;
  }
}

SearchedParameters searched_parameters(const std::vector<Parameter>& parameters,
                                       const VectorX& start, const Model& model) {
  SearchedParameters out;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    if (!is_found_with_motion(p.kind))
      throw InputError(fmt::format(
          "parameter '{}': not found together with the motion; expected friction, "
          "torsional_friction, rolling_friction, an inertial parameter, damping, dry_friction, "
          "breakaway_friction, stribeck_speed, armature, gravity or height, or another objective",
          p.name));
    const double value = start[static_cast<Eigen::Index>(i)];
    if (value < p.lower || value > p.upper)
      throw InputError(fmt::format(
          "parameter '{}': the scene has {:g}; expected a value between the bounds {:g} and {:g}",
          p.name, value, p.lower, p.upper));
    out.steps.push_back(step_parameter(parameters, i, start, model));
    // Friction scales forces, so the search uses its logarithm too.
    const bool factor = p.kind == ParameterKind::kFriction && p.lower > 0.0;
    out.shared.push_back({value, p.lower, p.upper, p.logarithmic || factor, p.deviation});
  }
  return out;
}

/// Estimates one motion alone down to kJoined, with the parameters of the scene. It starts once
/// from the low-passed recording, which blurs impacts, and once from the recorded rows; the result
/// with the lower cost is returned.
MotionPoint found_alone(const MotionProblem& problem, const std::vector<VectorX>& frames,
                        const MotionEstimateOptions& options) {
  MotionPoint start{low_pass(problem.model, frames, problem.h(), kBeginCutoff),
                    VectorX::Zero(problem.num_parameters())};
  MotionPoint best;
  double cost = kInfinity;
  for (const double smoothing : {kNearBegin, kFarBegin}) {
    MotionFit fit(problem, start, options.threads);
    MotionContinuation continuation;
    continuation.start = smoothing;
    continuation.end = kJoined;
    continuation.stop = options.stop;
    const ContinuationResult result = continue_motion(problem, continuation, fit);
    if (best.q.empty() || result.cost < cost) {
      best = fit.point();
      cost = result.cost;
    }
    start.q = frames;
  }
  return best;
}

/// The constants of sensors, which all recordings share, as parameters of the fit.
std::vector<SharedParameter> shared_constants(const std::vector<SensorConstant>& constants) {
  std::vector<SharedParameter> out;
  for (const SensorConstant& one : constants) {
    const double most = kMostDeviations * one.deviation;
    out.push_back({0.0, -most, most, false, one.deviation});
  }
  return out;
}

/// Sets the parameters of all motions, found for each alone, to their means.
void share_parameters(std::vector<MotionPoint>& points) {
  VectorX mean = VectorX::Zero(points[0].parameters.size());
  for (const MotionPoint& point : points)
    mean += point.parameters / static_cast<double>(points.size());
  for (MotionPoint& point : points) point.parameters = mean;
}

/// Refuses sensors whose readings depend on the parameters other than by the applied forces.
void check_sensors(const ColumnMap& map, const std::vector<Parameter>& parameters) {
  const bool gravity = std::any_of(parameters.begin(), parameters.end(), [](const Parameter& p) {
    return p.kind == ParameterKind::kGravity;
  });
  for (const Sensor& sensor : map.sensors) {
    if (sensor.kind == SensorKind::kContactForce || is_wrench(sensor.kind))
      throw InputError(fmt::format(
          "sensor '{}': parameters are not found from contact forces and wrenches; expected "
          "sensors of motions and of joint forces",
          sensor.name));
    if (gravity && sensor.kind == SensorKind::kSpecificForce)
      throw InputError(fmt::format(
          "sensor '{}': gravity is not found from specific forces; leave out one of them",
          sensor.name));
  }
}

/// Extrapolates the motions linearly from the ends of the last two stages; parameters are kept.
std::vector<MotionPoint> farther(const Model& model, const std::vector<MotionPoint>& before,
                                 const std::vector<MotionPoint>& last, double share) {
  std::vector<MotionPoint> out = last;
  VectorX difference(model.nv());
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t t = 0; t < out[i].q.size(); ++t) {
      configuration_difference(model, before[i].q[t], last[i].q[t], difference);
      integrate_configuration(model, last[i].q[t], difference, share, out[i].q[t]);
    }
  return out;
}

/// Lowers the smoothing from kJoined to `end` [m] in stages. Returns the number of Newton steps.
int harden(const Model& model, double end, const std::function<bool()>& stop, JointFit& fit) {
  std::vector<MotionPoint> before, last = fit.points();
  double smoothing_before = 0.0, smoothing_last = 0.0;
  int steps = 0;
  for (double smoothing = std::max(kJoined, end);;
       smoothing = std::max(end, smoothing / kStageFactor)) {
    const double loss = smoothing <= kLossBelow ? kLoss : 0.0;
    fit.begin(smoothing, loss, last);
    if (!before.empty()) {
      const double cost = fit.cost();
      const double share = (smoothing - smoothing_last) / (smoothing_last - smoothing_before);
      fit.begin(smoothing, loss, farther(model, before, last, share));
      if (!(fit.cost() < cost)) fit.begin(smoothing, loss, last);
    }
    steps += fit.minimize(kStageSteps, kStageTolerance, stop);
    if (smoothing_last > 0.0) {
      before = std::move(last);
      smoothing_before = smoothing_last;
    }
    last = fit.points();
    smoothing_last = smoothing;
    if (smoothing <= end || (stop && stop())) return steps;
  }
}

double median_ratio(const JointFit& fit) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < fit.size(); ++i) ratios.push_back(fit.measurement_ratio(i));
  return median(ratios);
}

/// Sets values, intervals and correlations. The covariance is inv(H) of the noise, plus a sandwich
/// term with the scatter of the motions' gradients, which measures how much the motions disagree.
void fill_fit(const std::vector<Parameter>& parameters, const SearchedParameters& searched,
              const std::vector<SensorConstant>& constants, JointFit& fit, ParameterEstimate& out) {
  const JointFit::Information information = fit.information();
  const MatrixX inverse = information.hessian.inverse();
  const VectorX values = fit.values();
  const auto p = static_cast<Eigen::Index>(parameters.size());
  VectorX slope = VectorX::Ones(p);  // d coordinate / d that of the parameter
  for (Eigen::Index i = 0; i < p; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (searched.shared[at].logarithmic && !parameters[at].logarithmic) slope[i] = 1.0 / values[i];
  }
  // The inverse of a block of the covariance is the information that is left when the other
  // coordinates, the constants of sensors, are free.
  const MatrixX alone =
      p == values.size() ? information.hessian : MatrixX(inverse.topLeftCorner(p, p).inverse());
  out.parameters.information = slope.asDiagonal() *
                               (alone - MatrixX(information.prior.head(p).asDiagonal())) *
                               slope.asDiagonal();
  out.parameters.information_by_recording =
      slope.cwiseAbs2().asDiagonal() * information.by_motion.topRows(p);
  for (std::size_t k = 0; k < constants.size(); ++k) {
    const auto at = p + static_cast<Eigen::Index>(k);
    out.constants.push_back(
        {constants[k].name, constants[k].unit, values[at], std::sqrt(inverse(at, at))});
  }
  const auto n = static_cast<double>(fit.size()), rest = n - static_cast<double>(values.size());
  MatrixX covariance = inverse;
  if (rest >= 1.0) covariance += (n / rest) * (inverse * information.scatter * inverse);
  const double quantile = fitting::student_95(rest >= 1.0 ? rest : 1e9);
  std::vector<fitting::EndPoint> ends;
  for (Eigen::Index i = 0; i < p; ++i) {
    const SharedParameter& shared = searched.shared[static_cast<std::size_t>(i)];
    ends.push_back({values[i], fit.coordinates()[i], shared.lower, shared.upper, shared.logarithmic,
                    fitting::is_told(inverse(i, i), information.prior[i], information.range[i])});
  }
  fitting::set_parameters(ends, covariance.topLeftCorner(p, p), quantile, out.parameters);
}

}  // namespace

ParameterEstimate estimate_parameters(const Scene& given_scene, const ColumnMap& map,
                                      const std::vector<const Recording*>& recordings,
                                      const std::vector<Parameter>& parameters,
                                      const MotionEstimateOptions& options) {
  const VectorX start = parameter_values(parameters, given_scene);
  const Scene scene = with_parameters(given_scene, parameters, start);
  SearchedParameters searched = searched_parameters(parameters, start, scene.model);
  check_sensors(map, parameters);
  ParameterEstimate out;
  std::vector<RecordedMotion> recorded;
  for (const Recording* one : recordings) {
    recorded.push_back(prepare(scene.model, map, *one));
    out.times.push_back(recorded.back().time);
  }
  const std::vector<SensorConstant>& constants = recorded[0].sensors.constants;
  for (const SharedParameter& one : shared_constants(constants)) searched.shared.push_back(one);
  out.smoothing = std::max(kHardEnd, scene.options.contact.smoothing);
  std::optional<JointFit> fit;
  for (int round = 0; round < kFigureRounds; ++round) {
    std::vector<MotionProblem> problems;
    std::vector<MotionPoint> points;
    for (const RecordedMotion& one : recorded) {
      MotionProblem problem = motion_problem(scene, one, white_priors(scene, map, one));
      points.push_back(found_alone(problem, one.frames, options));
      problem.parameters = searched.steps;
      problem.named = parameters;
      problem.named_values = start;
      problem.parameter_weight =
          VectorX::Zero(problem.num_parameters());  // JointFit has the priors
      VectorX all = problem.parameter_weight;
      all.tail(points.back().parameters.size()) = points.back().parameters;
      points.back().parameters = all;
      problems.push_back(std::move(problem));
    }
    share_parameters(points);
    fit.emplace(std::move(problems), points, searched.shared, options.threads);
    if (round == 0) {
      fit->begin(std::max(kJoined, out.smoothing), 0.0, points);
      out.parameters.start_cost = fit->cost();
    }
    out.parameters.evaluations += harden(scene.model, out.smoothing, options.stop, *fit);
    const double ratio = median_ratio(*fit);
    if (!(ratio > kSure) || (options.stop && options.stop())) break;
    for (RecordedMotion& one : recorded) one.noise *= std::sqrt(ratio);
  }
  out.parameters.cost = fit->cost();
  out.parameters.loss_scale = kLoss;
  out.parameters.stopped = options.stop && options.stop();
  fill_fit(parameters, searched, constants, *fit, out);
  out.cost_ratio.resize(static_cast<Eigen::Index>(fit->size()));
  for (MotionPoint& point : fit->points()) out.motions.push_back(std::move(point.q));
  for (std::size_t i = 0; i < fit->size(); ++i)
    out.cost_ratio[static_cast<Eigen::Index>(i)] = fit->measurement_ratio(i);
  return out;
}

}  // namespace counterpoint::estimation
