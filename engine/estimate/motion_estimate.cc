#include "counterpoint/engine/estimate/motion_estimate.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <set>

#include "counterpoint/engine/estimate/motion/frame_covariance.h"
#include "counterpoint/engine/estimate/motion/motion_filter.h"
#include "counterpoint/engine/estimate/motion/motion_priors.h"
#include "counterpoint/engine/estimate/motion/pair_forces.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// Rows are evenly spaced whose intervals differ by less than this share.
constexpr double kUneven = 0.02;
/// A recorded value farther off than this is an outlier [standard deviations].
constexpr double kOutlier = 6.0;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void check(const Recording& recording, const std::vector<char>& recorded) {
  const int rows = recording.num_rows();
  if (rows < kLeastRows)
    throw InputError(fmt::format("{}: {} rows; {} or more are expected to explain a motion",
                                 recording.file, rows, kLeastRows));
  if (std::find(recorded.begin(), recorded.end(), 1) == recorded.end())
    throw InputError(recording.file +
                     ": the column map names no position; a motion is explained from positions");
  const double h = (recording.time.back() - recording.time.front()) / (rows - 1);
  for (int row = 0; row + 1 < rows; ++row) {
    const double interval = recording.time[static_cast<std::size_t>(row) + 1] -
                            recording.time[static_cast<std::size_t>(row)];
    if (std::abs(interval - h) > kUneven * h)
      throw InputError(fmt::format(
          "{}: rows {} and {} are {:.6g} s apart, the mean is {:.6g} s; evenly spaced rows are "
          "expected (resample the recording, or cut it at the gap)",
          recording.file, row + 1, row + 2, interval, h));
  }
}

/// Rows of a result; forces are not known at the first and the last.
MotionEstimate empty_estimate(const Model& model, const Recording& recording) {
  MotionEstimate out;
  const int rows = recording.num_rows();
  out.file = recording.file;
  out.time = recording.time;
  out.q.resize(model.nq(), rows);
  out.v.resize(model.nv(), rows);
  out.force = MatrixX::Constant(model.nv(), rows, kNaN);
  out.force_deviation = out.force;
  out.contacts.resize(static_cast<std::size_t>(rows));
  out.cost_ratio = VectorX::Zero(rows);
  return out;
}

void set_motion(const Model& model, const std::vector<VectorX>& frames, double h,
                MotionEstimate& out) {
  VectorX before(model.nv()), behind(model.nv());
  const int last = static_cast<int>(frames.size()) - 1;
  for (int t = 0; t <= last; ++t) {
    const auto i = static_cast<std::size_t>(t);
    out.q.col(t) = frames[i];
    if (t > 0) configuration_difference(model, frames[i - 1], frames[i], before);
    if (t < last) configuration_difference(model, frames[i], frames[i + 1], behind);
    if (t == 0) before = behind;
    if (t == last) behind = before;
    out.v.col(t) = (before + behind) / (2.0 * h);
  }
}

/// The sums that are asked for, and one for each link that touches something.
std::vector<ContactSum> contact_sums(const Model& model, const MotionEstimateOptions& options,
                                     const MotionEstimate& estimate) {
  std::set<int> bodies;
  for (const auto& frame : estimate.contacts)
    for (const ContactEstimate& one : frame)
      for (const int geometry : {one.geometry_a, one.geometry_b})
        bodies.insert(model.geometries()[static_cast<std::size_t>(geometry)].body);
  std::vector<ContactSum> out = options.sums;
  for (const int body : bodies)
    if (body > 0) out.push_back({model.joint(body - 1).link, {body}});
  return out;
}

/// The share of a pair's force, on geometry B, that acts on some bodies: 1, -1, or 0.
double sign_of(const Model& model, const ContactEstimate& pair, const std::vector<int>& bodies) {
  const auto has = [&](int geometry) {
    const int body = model.geometries()[static_cast<std::size_t>(geometry)].body;
    return std::find(bodies.begin(), bodies.end(), body) != bodies.end();
  };
  return (has(pair.geometry_b) ? 1.0 : 0.0) - (has(pair.geometry_a) ? 1.0 : 0.0);
}

/// Covariance of some forces that depend on three frames (J) and on parameters (P): `neighbours` is
/// that of the frames with parameters held, and parameters move the frames by -gain.
struct Covariance {
  const MatrixX& neighbours;
  MatrixX gain;  ///< 3 nv x parameters
  const MatrixX& parameters;

  MatrixX of(const MatrixX& J, const MatrixX& P) const {
    MatrixX out = J * neighbours * J.transpose();
    if (parameters.rows() == 0) return out;
    const MatrixX total = P - J * gain;
    return out + total * parameters * total.transpose();
  }
};

VectorX deviations(const MatrixX& covariance) {
  return covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

/// Contact forces on links: sums over the pairs of row t, their deviations and centres.
void set_sums(const Model& model, int t, const MatrixX* covariance, MotionEstimate& out) {
  const std::vector<ContactEstimate>& pairs = out.contacts[static_cast<std::size_t>(t)];
  for (std::size_t s = 0; s < out.sums.size(); ++s) {
    const auto row = 3 * static_cast<Eigen::Index>(s);
    MatrixX pick = MatrixX::Zero(3, 3 * static_cast<Eigen::Index>(pairs.size()));
    Vector3 force = Vector3::Zero(), centre = Vector3::Zero();
    double pressure = 0.0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const double sign = sign_of(model, pairs[k], out.sums[s].bodies);
      pick.block<3, 3>(0, 3 * static_cast<Eigen::Index>(k)) = sign * Matrix3::Identity();
      if (sign == 0.0) continue;
      force += sign * pairs[k].force;
      centre += pairs[k].normal_force * pairs[k].centre;
      pressure += pairs[k].normal_force;
    }
    out.sum_force.block<3, 1>(row, t) = force;
    if (pressure > 0.0) out.sum_centre.block<3, 1>(row, t) = centre / pressure;
    out.sum_deviation.block<3, 1>(row, t).setZero();
    if (covariance != nullptr && !pairs.empty())
      out.sum_deviation.block<3, 1>(row, t) =
          deviations(pick * *covariance * pick.transpose());
  }
}

void size_sums(const Model& model, const MotionEstimateOptions& options, MotionEstimate& out) {
  out.sums = contact_sums(model, options, out);
  const auto rows = 3 * static_cast<Eigen::Index>(out.sums.size());
  const auto columns = static_cast<Eigen::Index>(out.time.size());
  out.sum_force = out.sum_deviation = out.sum_centre = MatrixX::Constant(rows, columns, kNaN);
}

/// Forces and contacts of a fit, with their standard deviations.
void set_forces(const Model& model, const MotionProblem& problem,
                const MotionEstimateOptions& options, MotionFit& fit, MotionEstimate& out) {
  MotionSystem& system = fit.linearized();
  const FrameCovariance frames(system.band());
  const std::vector<PairForces> pairs = differentiate_pair_forces(problem, fit);
  const MatrixX parameters = system.parameter_covariance();
  const int nv = model.nv();
  for (std::size_t t = 0; t < pairs.size(); ++t) out.contacts[t] = pairs[t].pairs;
  size_sums(model, options, out);
  for (int t = 1; t + 1 < problem.frames(); ++t) {
    const auto i = static_cast<std::size_t>(t);
    MatrixX gain(3 * nv, parameters.rows());
    for (Eigen::Index k = 0; k < parameters.rows(); ++k)
      gain.col(k) = Eigen::Map<const VectorX>(
          system.gain()[static_cast<std::size_t>(k)].col(t - 1).data(), 3 * nv);
    const MatrixX neighbours = frames.of(t - 1, 3);
    const Covariance covariance{neighbours, std::move(gain), parameters};
    const Instant& instant = fit.instants()[i];
    out.force.col(t) = instant.force;
    out.force_deviation.col(t) =
        deviations(covariance.of(instant.by_frames, instant.by_parameters));
    const MatrixX of_pairs = covariance.of(pairs[i].by_frames, pairs[i].by_parameters);
    const VectorX by_pair = deviations(of_pairs);
    for (std::size_t k = 0; k < out.contacts[i].size(); ++k)
      out.contacts[i][k].deviation = by_pair.segment<3>(3 * static_cast<Eigen::Index>(k));
    set_sums(model, t, &of_pairs, out);
  }
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    const auto index = static_cast<Eigen::Index>(k);
    const int geometry = problem.parameters[k].targets.front();
    out.parameters.push_back(
        {"place:" + model.geometries()[static_cast<std::size_t>(geometry)].name, "m",
         fit.point().parameters[index], std::sqrt(std::max(0.0, parameters(index, index)))});
  }
}

/// How well the measurements fit, row by row, and which do not.
void set_residuals(const Model& model, const MotionProblem& problem,
                   const std::vector<VectorX>& frames, MotionEstimate& out) {
  VectorX difference(model.nv());
  for (int t = 0; t < problem.frames(); ++t) {
    const auto i = static_cast<std::size_t>(t);
    configuration_difference(model, frames[i], problem.measured[i], difference);
    double sum = 0.0;
    int count = 0;
    for (int k = 0; k < model.nv(); ++k) {
      const double weight = problem.position_weight(k, t), ratio = difference[k] * weight;
      if (weight <= 0.0) continue;
      ++count;
      sum += ratio * ratio;
      if (std::abs(ratio) > kOutlier) out.outliers.push_back({t, k, difference[k], std::abs(ratio)});
    }
    out.cost_ratio[t] = count > 0 ? sum / count : 0.0;
  }
}

void set_unexplained(const Model& model, MotionEstimate& out) {
  const VectorX weights =
      optimization::unactuated_weights(model, optimization::motors_of(model));
  int rows = 0;
  for (Eigen::Index t = 1; t + 1 < out.force.cols(); ++t, ++rows) {
    const double largest = out.force.col(t).cwiseProduct(weights).cwiseAbs().maxCoeff();
    out.unexplained_mean += largest;
    out.unexplained_max = std::max(out.unexplained_max, largest);
  }
  if (rows > 0) out.unexplained_mean /= rows;
}

}  // namespace

MotionEstimate estimate_motion(const Scene& scene, const ColumnMap& map,
                               const Recording& recording, const MotionEstimateOptions& options) {
  const double start = now();
  const Model& model = scene.model;
  const std::vector<char> recorded = recorded_coordinates(model, map);
  check(recording, recorded);
  MotionEstimate out = empty_estimate(model, recording);
  MotionPriors priors = choose_priors(scene, recording, recorded);
  MotionProblem problem = motion_problem(scene, recording, priors);
  const auto parameters = static_cast<Eigen::Index>(problem.parameters.size());
  MotionFit fit(problem, {start_frames(problem, priors), VectorX::Zero(parameters)},
                options.threads);
  MotionContinuation continuation;
  continuation.start = priors.smoothing_start;
  continuation.end = priors.smoothing_end;
  continuation.stop = options.stop;
  ContinuationResult result = continue_motion(problem, continuation, fit);
  for (int round = 0; round < (getenv("ROUNDS") ? atoi(getenv("ROUNDS")) : 0); ++round) {
    update_priors(model, problem, fit, priors);
    MotionProblem next = motion_problem(scene, recording, priors);
    problem.position_weight = next.position_weight;
    problem.acceleration_weight = next.acceleration_weight;
    problem.size_weight = next.size_weight;
    problem.change_weight = next.change_weight;
    const MotionPoint at = fit.point();
    fit.begin(stage_options(problem, result.smoothing), at);
    result.steps += fit.minimize(40, 1e-3, options.stop);
  }
  out.smoothing = result.smoothing;
  out.newton_steps = result.steps;
  out.position_deviation = priors.position;
  set_motion(model, fit.point().q, problem.h(), out);
  set_forces(model, problem, options, fit, out);
  set_residuals(model, problem, fit.point().q, out);
  set_unexplained(model, out);
  out.stopped = options.stop && options.stop();
  out.seconds = now() - start;
  return out;
}

}  // namespace counterpoint::estimation
