#include "counterpoint/engine/estimate/motion/motion_result.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion/frame_covariance.h"
#include "counterpoint/engine/estimate/motion/pair_forces.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Limit beyond which a recorded position is an outlier [standard deviations].
constexpr double kOutlier = 6.0;
/// The same limit for accelerations; the largest within `kSameRows` rows is reported.
constexpr double kPush = 30.0;
constexpr int kSameRows = 10;
/// Residuals are clipped at kMostResidual standard deviations in autocorrelations, so that single
/// impacts between rows do not dominate; kLeastProducts is the minimum number of products.
constexpr double kMostResidual = 3.0;
constexpr int kLeastProducts = 20;

/// Sign of a pair's force (on geometry B) in the sum over `bodies`: 1, -1, or 0.
double sign_of(const Model& model, const ContactEstimate& pair, const std::vector<int>& bodies) {
  const auto has = [&](int geometry) {
    const int body = model.geometries()[static_cast<std::size_t>(geometry)].body;
    return std::find(bodies.begin(), bodies.end(), body) != bodies.end();
  };
  return (has(pair.geometry_b) ? 1.0 : 0.0) - (has(pair.geometry_a) ? 1.0 : 0.0);
}

/// Covariance of forces with derivatives J (three frames) and P (parameters).
struct Covariance {
  MatrixX frames;  ///< 3 nv x 3 nv, for fixed parameters
  MatrixX gain;    ///< 3 nv x parameters: a change p of these moves the frames by -gain p
  const MatrixX& parameters;

  MatrixX of(const MatrixX& J, const MatrixX& P) const {
    MatrixX out = J * frames * J.transpose();
    if (parameters.rows() == 0) return out;
    const MatrixX total = P - J * gain;
    return out + total * parameters * total.transpose();
  }
};

VectorX deviations(const MatrixX& covariance) {
  return covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

void set_parameters(const MotionProblem& problem, const VectorX& values, const MatrixX& covariance,
                    MotionEstimate& out) {
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const auto geometry = static_cast<std::size_t>(problem.parameters[k].targets.front());
    out.parameters.push_back({"place:" + problem.model.geometries()[geometry].name, "m", values[i],
                              std::sqrt(std::max(0.0, covariance(i, i)))});
  }
  for (std::size_t k = 0; k < problem.constants.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(problem.parameters.size() + k);
    const SensorConstant& constant = problem.constants[k];
    out.parameters.push_back(
        {constant.name, constant.unit, values[i], std::sqrt(std::max(0.0, covariance(i, i)))});
  }
}

/// Adds a row's normalized residuals to the figures of their sensors.
void add_readings(const VectorX& residual, const std::vector<int>& term, MotionEstimate& out) {
  int last = -1;
  for (Eigen::Index k = 0; k < residual.size(); ++k) {
    const int own = term[static_cast<std::size_t>(k)];
    SensorMetrics& metrics = out.sensors[static_cast<std::size_t>(own)];
    metrics.rms +=
        residual[k] * residual[k];  // sum of squares; set_sensors takes the root of its mean
    metrics.outliers += std::abs(residual[k]) > kOutlier ? 1 : 0;
    metrics.rows += own != std::exchange(last, own) ? 1 : 0;
  }
}

/// Sets the figures of each sensor, and adds the sensors' part of the rows' cost ratios.
void set_sensors(const MotionProblem& problem, const MotionFit& fit, VectorX& squares,
                 VectorX& counts, MotionEstimate& out) {
  for (const SensorTerm& term : problem.sensors)
    out.sensors.push_back({term.sensor.name, term.sensor.kind, 0, 1.0 / term.weight, 0.0, 0});
  SensorRows rows(problem.model, problem.sensors, static_cast<int>(problem.constants.size()));
  const std::vector<int> force_terms = ForceSensors(problem.sensors).term_of_row();
  for (int t = 0; t < problem.frames() && !problem.sensors.empty(); ++t) {
    rows.evaluate(problem.model, problem.sensor_frames(fit.point().q, fit.point().parameters), t,
                  false);
    for (const WeightedRows* one : {&rows.of_frame(), &rows.of_motion()}) {
      add_readings(one->residual.head(one->size), one->term, out);
      squares[t] += one->residual.head(one->size).squaredNorm();
      counts[t] += one->size;
    }
    add_readings(fit.instants()[static_cast<std::size_t>(t)].sensed, force_terms, out);
  }
  for (SensorMetrics& one : out.sensors)
    if (one.rows > 0)
      one.rms = one.deviation * std::sqrt(one.rms / (one.rows * error_size(one.kind)));
}

/// Sets the cost ratio of each row: mean square of the normalized residuals of coordinates and
/// sensors.
void set_cost_ratios(const MotionProblem& problem, const MotionFit& fit, MotionEstimate& out) {
  VectorX squares = VectorX::Zero(problem.frames()), counts = squares;
  set_sensors(problem, fit, squares, counts, out);
  VectorX difference(problem.nv());
  for (int t = 0; t < problem.frames(); ++t) {
    const auto i = static_cast<std::size_t>(t);
    configuration_difference(problem.model, problem.measured[i], fit.point().q[i], difference);
    const VectorX ratio = difference.cwiseProduct(problem.position_weight.col(t));
    squares[t] += ratio.squaredNorm();
    counts[t] += static_cast<double>((problem.position_weight.col(t).array() > 0.0).count());
    out.cost_ratio[t] = counts[t] > 0.0 ? squares[t] / counts[t] : 0.0;
    for (int k = 0; k < problem.nv(); ++k)
      if (std::abs(ratio[k]) > kOutlier)
        out.outliers.push_back({t, k, -difference[k], std::abs(ratio[k])});
  }
}

/// Adds outliers: accelerations of the recording that the estimate does not follow.
void add_pushes(const MotionProblem& problem, const std::vector<VectorX>& frames,
                MotionEstimate& out) {
  if (problem.acceleration_weight.isZero(0.0)) return;
  const MatrixX found = accelerations(problem.model, frames, problem.h());
  std::optional<Outlier> worst;
  for (int t = 1; t + 1 < problem.frames(); ++t) {
    const VectorX off = problem.acceleration.col(t) - found.col(t);
    Eigen::Index k = 0;
    const double most = off.cwiseProduct(problem.acceleration_weight).cwiseAbs().maxCoeff(&k);
    if (worst && t > worst->row + kSameRows) {
      out.outliers.push_back(*worst);
      worst.reset();
    }
    if (most > kPush && (!worst || most > worst->deviations))
      worst = Outlier{t, static_cast<int>(k), off[k], most, true};
  }
  if (worst) out.outliers.push_back(*worst);
}

}  // namespace

const char* recording_errors_name(RecordingErrors errors) {
  return errors == RecordingErrors::kNone    ? "none"
         : errors == RecordingErrors::kWhite ? "white"
                                             : "slow";
}

MotionEstimate empty_estimate(const Model& model, const std::vector<double>& time,
                              std::vector<ContactSum> sums) {
  MotionEstimate out;
  const auto rows = static_cast<Eigen::Index>(time.size());
  out.time = time;
  out.q = MatrixX::Constant(model.nq(), rows, kNaN);
  out.v = MatrixX::Constant(model.nv(), rows, kNaN);
  out.force = MatrixX::Constant(model.nv(), rows, kNaN);
  out.force_deviation = out.force;
  out.contacts.resize(time.size());
  out.cost_ratio = VectorX::Zero(rows);
  out.sums = std::move(sums);
  const auto components = 3 * static_cast<Eigen::Index>(out.sums.size());
  out.sum_force = out.sum_deviation = out.sum_centre = MatrixX::Constant(components, rows, kNaN);
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

void set_forces(const MotionProblem& problem, MotionFit& fit, MotionEstimate& out) {
  MotionSystem& system = fit.linearized();
  const FrameCovariance covariances(system.band());
  const std::vector<PairForces> pairs = differentiate_pair_forces(problem, fit);
  MatrixX parameters = system.parameter_covariance();
  set_parameters(problem, fit.point().parameters, parameters, out);
  parameters.diagonal().head(static_cast<Eigen::Index>(problem.parameters.size())).array() +=
      std::pow(problem.parameter_drift, 2);
  const int nv = problem.nv();
  for (std::size_t t = 0; t < pairs.size(); ++t) out.contacts[t] = pairs[t].pairs;
  fit.pool().run(problem.frames(), [&](int t, int) {
    if (t == 0 || t + 1 == problem.frames()) return;
    const auto i = static_cast<std::size_t>(t);
    Covariance covariance{covariances.of(t - 1, 3), MatrixX(3 * nv, parameters.rows()), parameters};
    for (Eigen::Index k = 0; k < parameters.rows(); ++k)
      covariance.gain.col(k) = Eigen::Map<const VectorX>(
          system.gain()[static_cast<std::size_t>(k)].col(t - 1).data(), 3 * nv);
    const Instant& instant = fit.instants()[i];
    out.force.col(t) = instant.force;
    out.force_deviation.col(t) =
        deviations(covariance.of(instant.by_frames, instant.by_parameters));
    const MatrixX of_pairs = covariance.of(pairs[i].by_frames, pairs[i].by_parameters);
    const VectorX by_pair = deviations(of_pairs);
    for (std::size_t k = 0; k < out.contacts[i].size(); ++k)
      out.contacts[i][k].deviation = by_pair.segment<3>(3 * static_cast<Eigen::Index>(k));
    set_sums(problem.model, t, &of_pairs, out);
  });
  set_cost_ratios(problem, fit, out);
  add_pushes(problem, fit.point().q, out);
}

VectorX residual_correlation(const Model& model, const RecordedMotion& recorded, const MatrixX& q,
                             const VectorX& deviation) {
  const int nv = model.nv();
  VectorX product = VectorX::Zero(nv), square = product, products = product, last = product;
  for (int t = 0; t < recorded.rows(); ++t) {
    const VectorX measured = recorded.measured.col(t).cwiseSign();
    VectorX now = VectorX::Constant(nv, kNaN);
    const VectorX off = difference(model, q.col(t), recorded.frames[static_cast<std::size_t>(t)]);
    for (int i = 0; i < nv; ++i) {
      if (measured[i] == 0.0 || !std::isfinite(off[i])) continue;
      now[i] = std::clamp(off[i] / deviation[i], -kMostResidual, kMostResidual);
      if (t == 0 || !std::isfinite(last[i])) continue;
      product[i] += now[i] * last[i];
      square[i] += 0.5 * (now[i] * now[i] + last[i] * last[i]);
      products[i] += 1.0;
    }
    last = now;
  }
  return (products.array() >= kLeastProducts && square.array() > 0.0)
      .select(product.cwiseQuotient(square), kNaN);
}

void set_forces_alone(const MotionProblem& problem, const MotionFit& fit, MotionEstimate& out) {
  const VectorX& parameters = fit.point().parameters;
  set_parameters(problem, parameters,
                 MatrixX::Constant(parameters.size(), parameters.size(), kInfinity), out);
  InstantModel instant(problem, fit.model());
  for (int t = 1; t + 1 < problem.frames(); ++t)
    set_unsure(problem.model, instant.invert(fit.point(), fit.options(), t), t, out);
  set_cost_ratios(problem, fit, out);
  add_pushes(problem, fit.point().q, out);
}

void set_unsure(const Model& model, const Inverse& inverse, int row, MotionEstimate& out) {
  set_inverse(model, inverse, row, out);
  set_sums(model, row, nullptr, out);
  out.force_deviation.col(row).setConstant(kNaN);
  out.sum_deviation.col(row).setConstant(kNaN);
  for (ContactEstimate& pair : out.contacts[static_cast<std::size_t>(row)])
    pair.deviation.setConstant(kNaN);
}

void set_inverse(const Model& model, const Inverse& inverse, int row, MotionEstimate& out) {
  out.force.col(row) = inverse.applied_force;
  out.force_deviation.col(row).setZero();
  out.contacts[static_cast<std::size_t>(row)] = pair_forces(model, inverse);
}

std::vector<ContactSum> with_links(const Model& model, std::vector<ContactSum> sums) {
  std::set<int> bodies;
  for (const Geometry& geometry : model.geometries()) bodies.insert(geometry.body);
  for (const int body : bodies)
    if (body > 0) sums.push_back({model.joint(body - 1).link, {body}});
  return sums;
}

void leave_out_untouched(std::size_t wanted, MotionEstimate& out) {
  std::vector<Eigen::Index> kept;
  std::vector<ContactSum> sums;
  for (std::size_t s = 0; s < out.sums.size(); ++s) {
    const auto at = 3 * static_cast<Eigen::Index>(s);
    const auto rows = out.sum_centre.middleRows<3>(at);
    if (s >= wanted && !(rows.array() == rows.array()).any())
      continue;  // all NaN: never in contact
    sums.push_back(out.sums[s]);
    for (Eigen::Index k = 0; k < 3; ++k) kept.push_back(at + k);
  }
  out.sums = std::move(sums);
  for (MatrixX* rows : {&out.sum_force, &out.sum_deviation, &out.sum_centre})
    *rows = MatrixX((*rows)(kept, Eigen::all));
}

void set_sums(const Model& model, int row, const MatrixX* covariance, MotionEstimate& out) {
  const std::vector<ContactEstimate>& pairs = out.contacts[static_cast<std::size_t>(row)];
  for (std::size_t s = 0; s < out.sums.size(); ++s) {
    const auto at = 3 * static_cast<Eigen::Index>(s);
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
    out.sum_force.block<3, 1>(at, row) = force;
    if (pressure > 0.0) out.sum_centre.block<3, 1>(at, row) = centre / pressure;
    out.sum_deviation.block<3, 1>(at, row).setZero();
    if (covariance != nullptr && !pairs.empty())
      out.sum_deviation.block<3, 1>(at, row) = deviations(pick * *covariance * pick.transpose());
  }
}

void summarize(const Model& model, const RecordedMotion& recorded, MotionEstimate& out) {
  out.outliers.insert(out.outliers.end(), recorded.spikes.begin(), recorded.spikes.end());
  std::stable_sort(out.outliers.begin(), out.outliers.end(),
                   [](const Outlier& a, const Outlier& b) { return a.row < b.row; });
  out.mean_cost_ratio = out.cost_ratio.mean();
  out.residual_correlation = VectorX::Constant(model.nv(), kNaN);
  if (out.errors == RecordingErrors::kWhite)
    out.residual_correlation = residual_correlation(model, recorded, out.q, out.position_deviation);
  const VectorX weights = optimization::unactuated_weights(model, optimization::motors_of(model));
  int rows = 0;
  for (Eigen::Index t = 0; t < out.force.cols(); ++t) {
    if (!out.force.col(t).allFinite()) continue;
    const double largest = out.force.col(t).cwiseProduct(weights).cwiseAbs().maxCoeff();
    out.unexplained_mean += largest;
    out.unexplained_max = std::max(out.unexplained_max, largest);
    ++rows;
  }
  if (rows > 0) out.unexplained_mean /= rows;
}

void append(const MotionEstimate& part, int first, int skip, MotionEstimate& out) {
  const auto rows = static_cast<Eigen::Index>(part.time.size()) - skip;
  const auto put = [&](const MatrixX& from, MatrixX& to) {
    to.middleCols(first + skip, rows) = from.middleCols(skip, rows);
  };
  put(part.q, out.q);
  put(part.v, out.v);
  put(part.force, out.force);
  put(part.force_deviation, out.force_deviation);
  put(part.sum_force, out.sum_force);
  put(part.sum_deviation, out.sum_deviation);
  put(part.sum_centre, out.sum_centre);
  out.cost_ratio.segment(first + skip, rows) = part.cost_ratio.segment(skip, rows);
  std::copy(part.contacts.begin() + skip, part.contacts.end(), out.contacts.begin() + first + skip);
  for (Outlier one : part.outliers) {
    if (one.row < skip) continue;
    one.row += first;
    out.outliers.push_back(one);
  }
  for (const EstimatedParameter& one : part.parameters) {
    const auto same = std::find_if(out.parameters.begin(), out.parameters.end(),
                                   [&](const auto& other) { return other.name == one.name; });
    if (same == out.parameters.end()) {
      out.parameters.push_back(one);
      continue;
    }
    const double a = std::pow(same->deviation, -2), b = std::pow(one.deviation, -2);
    same->value = (a * same->value + b * one.value) / (a + b);
    same->deviation = 1.0 / std::sqrt(a + b);
  }
  for (const SensorMetrics& one : part.sensors) {
    const auto same = std::find_if(out.sensors.begin(), out.sensors.end(), [&](const auto& other) {
      return other.name == one.name && other.kind == one.kind;
    });
    if (same == out.sensors.end()) {
      out.sensors.push_back(one);
      continue;
    }
    const double read = std::max(1, same->rows + one.rows);
    same->rms =
        std::sqrt((same->rows * same->rms * same->rms + one.rows * one.rms * one.rms) / read);
    same->rows += one.rows;
    same->outliers += one.outliers;
  }
  out.smoothing = std::max(out.smoothing, part.smoothing);
  out.newton_steps += part.newton_steps;
}

}  // namespace counterpoint::estimation
