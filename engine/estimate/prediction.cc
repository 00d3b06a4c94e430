#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "counterpoint/engine/constraints/bounce.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {
namespace {

/// More steps per row than this mean that time is not in seconds or that the recording pauses.
constexpr double kMaxRowSteps = 1e5;

int steps_of_row(const Recording& recording, int row, double interval,
                 const PredictionOptions& options) {
  if (options.substeps) return *options.substeps;
  const double steps = interval / options.scene_step;
  if (steps > kMaxRowSteps)
    throw InputError(
        fmt::format("{}: rows {} and {} are {:.6g} s apart, {:.3g} time steps of the scene; where "
                    "the time is not in seconds the "
                    "column map says time: {{column: C, scale: S}}, where the recording pauses it "
                    "is to be cut, and substeps sets "
                    "the number of steps",
                    recording.file, row + 1, row + 2, interval, steps));
  return std::max(1, static_cast<int>(std::lround(steps)));
}

/// Returns the column of a sensor table at which a measurement begins.
int first_column(const SensorTable& table, const Sensor& sensor) {
  const auto& columns = table.columns();
  const auto first = std::find_if(columns.begin(), columns.end(), [&](const SensorColumn& one) {
    return one.sensor == sensor.scene_sensor;
  });
  return static_cast<int>(first - columns.begin()) + sensor.scene_row;
}

/// Wraps an angle to [-pi, pi] [rad].
double on_circle(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

}  // namespace

Deviation& Deviation::operator+=(const Deviation& o) {
  position += o.position;
  rotation += o.rotation;
  joints += o.joints;
  return *this;
}

Deviation deviation(const Model& model, const ColumnMap& map, const VectorX& q,
                    const VectorX& recorded) {
  Deviation result;
  if (map.free_body >= 0) {
    const int i = model.body(map.free_body).q_index;
    result.position = (q.segment<3>(i) - recorded.segment<3>(i)).norm();
    const Quaternion a(q[i + 3], q[i + 4], q[i + 5], q[i + 6]);
    const Quaternion b(recorded[i + 3], recorded[i + 4], recorded[i + 5], recorded[i + 6]);
    result.rotation =
        quaternion_log((a.conjugate() * b).normalized()).norm() * 180.0 / std::numbers::pi;
    return result;
  }
  int joints = 0;
  const std::vector<int> circular = circular_positions(model);
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    const double difference = q[entry.index] - recorded[entry.index];
    result.joints += std::abs(std::binary_search(circular.begin(), circular.end(), entry.index)
                                  ? on_circle(difference)
                                  : difference);
    ++joints;
  }
  result.joints /= std::max(joints, 1);
  return result;
}

void recorded_difference(const Model& model, const VectorX& recorded, const VectorX& q,
                         VectorX& out) {
  configuration_difference(model, recorded, q, out);
  const std::vector<int> circular = circular_positions(model);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const int angle = joint_nv(body.joint_type) - 1;
    if (std::binary_search(circular.begin(), circular.end(), body.q_index + angle))
      out[body.v_index + angle] = on_circle(out[body.v_index + angle]);
  }
}

double row_interval(const ColumnMap& map, const Recording& recording, int row) {
  return map.rate ? 1.0 / *map.rate : recording.time[row + 1] - recording.time[row];
}

State recorded_state(const Model& model, const ColumnMap& map, const Recording& recording,
                     int row) {
  State state{recording.time[row], recording.q.col(row), recording.v.col(row)};
  if (!map.backward_difference) return state;
  // The recorded velocity is the mean over the interval before the row.
  const double interval = row_interval(map, recording, std::max(row - 1, 0));
  const std::vector<Vector3> fall = free_fall(model);
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    if (body.joint_type != JointType::kFloating) continue;
    state.v.segment<3>(body.v_index) += 0.5 * interval * fall[static_cast<size_t>(b)];
  }
  return state;
}

Compared compared(const ColumnMap& map) {
  if (!map.after.empty()) return Compared::kImpacts;
  return map.free_body >= 0 ? Compared::kPose : Compared::kJoints;
}

Predictor::Predictor(const Scene& scene, const ColumnMap& map, const PredictionOptions& options)
    : simulator_(scene), map_(map), options_(options) {
  if (!map.after.empty()) impacts_.emplace(scene);
  if (map.sensors.empty()) return;
  table_.emplace(model(), simulator_.options());
  for (const Sensor& sensor : map.sensors) {
    first_.push_back(first_column(*table_, sensor));
    sensed_ += static_cast<Eigen::Index>(sensor.columns.size());
  }
}

/// Simulates from `row` to `row` + 1. Returns false if a step failed or the prediction is to stop.
bool Predictor::predict_row(const Recording& recording, int row, PredictionWatch* watch,
                            Prediction& out) {
  Simulator& simulator = simulator_;
  const double interval = row_interval(map_, recording, row);
  const int substeps = steps_of_row(recording, row, interval, options_);
  simulator.options().time_step = interval / substeps;
  simulator.input().applied_force = recording.applied_force.col(row);
  if (recording.inputs.cols() > 0)
    map_.input_columns.set(simulator.model(), recording.inputs.col(row), simulator.input());
  for (int k = 0; k < substeps; ++k) {
    out.stopped = options_.stop && options_.stop();
    if (out.stopped) return false;
    const bool reads = table_ && k == 0;
    State before;
    if (watch || reads) before = simulator.state();
    const StepReport step = simulator.step();
    if ((watch || reads) && step.succeeded()) {
      Input input = simulator.input();
      input.z = before.z;
      input.softening = step.softening;
      find_taut_links(simulator.state(), input.taut_links);
      if (watch) watch->step(simulator.options(), before, input, simulator.state());
      if (reads) read_sensors(recording, row, before, input, out);
    }
    out.newton_iterations += step.newton_iterations;
    if (!step.succeeded()) out.failure = {out.steps, simulator.state().time, step};
    ++out.steps;
    if (out.failure) return false;
  }
  return true;
}

void Predictor::read_sensors(const Recording& recording, int row, const State& before,
                             const Input& input, Prediction& out) {
  VectorX values(table_->size());
  const State& after = simulator_.state();
  table_->evaluate({before.q, before.v, after.q, after.v, input, simulator_.options().time_step},
                   values);
  Eigen::Index next = 0;
  for (std::size_t s = 0; s < map_.sensors.size(); ++s) {
    const auto size = static_cast<Eigen::Index>(map_.sensors[s].columns.size());
    auto sensed = out.sensors.col(row).segment(next, size);
    sensed = values.segment(first_[s], size);
    // A quaternion and its opposite are one orientation.
    if (size == 4 && sensed.dot(recording.sensors[s].values.col(row)) < 0.0) sensed = -sensed;
    next += size;
  }
}

Prediction Predictor::predict(const Recording& recording, PredictionWatch* watch) {
  return impacts_ ? strike(recording) : roll_out(recording, watch);
}

Prediction Predictor::strike(const Recording& recording) {
  Prediction out;
  out.file = recording.file;
  out.rows = recording.num_rows();
  out.q = recording.q;
  const Impact& impact = impacts_->solve(recording.q.col(0), recording.v.col(0));
  const VectorX after = recording.v.col(1);
  ImpactDeviation& deviation = out.impact.emplace();
  out.velocity_error = impact.v - after;
  out.recorded_velocity = after;
  deviation.weighted = impacts_->weighted(out.velocity_error);
  deviation.speed = deviation.weighted.norm();
  deviation.energy_ratio = impact.energy / impact.energy_before;
  deviation.recorded_energy_ratio = impacts_->weighted(after).squaredNorm() /
                                    impacts_->weighted(recording.v.col(0)).squaredNorm();
  deviation.contacts = impact.contacts;
  return out;
}

Prediction Predictor::roll_out(const Recording& recording, PredictionWatch* watch) {
  const Model& model = simulator_.model();
  const int rows = recording.num_rows();
  const int horizon = options_.horizon > 0 ? options_.horizon : rows - 1;
  Prediction out;
  out.file = recording.file;
  out.rows = rows;
  out.q = recording.q;
  if (table_) out.sensors.setConstant(sensed_, rows, std::numeric_limits<double>::quiet_NaN());
  int pieces = 0;
  for (int start = 0; start + 1 < rows; start += horizon) {
    simulator_.set_state(recorded_state(model, map_, recording, start));
    if (watch) watch->start(recording, start);
    const int last = std::min(start + horizon, rows - 1);
    for (int row = start; row < last; ++row) {
      if (!predict_row(recording, row, watch, out)) return out;
      if (watch) watch->row(recording, row + 1, simulator_.state());
      out.q.col(row + 1) = simulator_.state().q;
      out.time.push_back(recording.time[row + 1]);
      out.deviations.push_back(
          deviation(model, map_, simulator_.state().q, recording.q.col(row + 1)));
      out.mean += out.deviations.back();
    }
    out.end += out.deviations.back();
    const VectorX recorded = recorded_state(model, map_, recording, last).v;
    out.velocity_error.conservativeResize(model.nv(), ++pieces);
    out.recorded_velocity.conservativeResize(model.nv(), pieces);
    out.velocity_error.col(pieces - 1) = simulator_.state().v - recorded;
    out.recorded_velocity.col(pieces - 1) = recorded;
  }
  out.mean = out.mean * (1.0 / (rows - 1));
  out.end = out.end * (1.0 / pieces);
  return out;
}

std::vector<std::pair<const char*, double>> metrics(const Prediction& p, Compared by) {
  if (by == Compared::kImpacts) {
    const ImpactDeviation impact = p.impact.value_or(ImpactDeviation());
    return {{"velocity_error_m_s", impact.speed},
            {"energy_ratio", impact.energy_ratio},
            {"recorded_energy_ratio", impact.recorded_energy_ratio}};
  }
  if (by == Compared::kJoints)
    return {{"joint_error_mean", p.mean.joints}, {"joint_error_end", p.end.joints}};
  return {{"position_error_mean_m", p.mean.position},
          {"rotation_error_mean_deg", p.mean.rotation},
          {"position_error_end_m", p.end.position},
          {"rotation_error_end_deg", p.end.rotation}};
}

std::vector<std::pair<const char*, double>> median_metrics(
    const std::vector<Prediction>& predictions, Compared by) {
  std::vector<std::pair<const char*, double>> medians;
  for (size_t i = 0; !predictions.empty() && i < metrics(predictions[0], by).size(); ++i) {
    std::vector<double> values;
    for (const Prediction& prediction : predictions)
      if (!prediction.failure) values.push_back(metrics(prediction, by)[i].second);
    if (!values.empty()) medians.emplace_back(metrics(predictions[0], by)[i].first, median(values));
  }
  return medians;
}

std::vector<CoordinateMetrics> velocity_metrics(const ColumnMap& map,
                                                const std::vector<Prediction>& predictions) {
  Eigen::Index count = 0;
  for (const Prediction& p : predictions) count += p.velocity_error.cols();
  std::vector<CoordinateMetrics> out;
  for (const ColumnMap::Entry& entry : map.after.empty() ? map.entries : map.after) {
    if (entry.kind != ColumnMap::Entry::Kind::kVelocity || count == 0) continue;
    VectorX error(count), recorded(count);
    Eigen::Index at = 0;
    for (const Prediction& p : predictions) {
      if (p.velocity_error.cols() == 0) continue;  // failed in its first piece
      error.segment(at, p.velocity_error.cols()) = p.velocity_error.row(entry.index).transpose();
      recorded.segment(at, p.velocity_error.cols()) =
          p.recorded_velocity.row(entry.index).transpose();
      at += p.velocity_error.cols();
    }
    out.push_back(coordinate_metrics(entry.name, error, recorded));
  }
  return out;
}

std::vector<CoordinateMetrics> sensor_metrics(const Model& model, const ColumnMap& map,
                                              const std::vector<Recording>& recordings,
                                              const std::vector<Prediction>& predictions) {
  std::vector<CoordinateMetrics> out;
  Eigen::Index next = 0;
  for (std::size_t s = 0; s < map.sensors.size(); ++s) {
    const Sensor& sensor = map.sensors[s];
    const auto& of_scene = model.sensors()[static_cast<std::size_t>(sensor.scene_sensor)];
    const std::vector<SensorRow> rows = sensor_rows(model, of_scene);
    for (std::size_t k = 0; k < sensor.columns.size(); ++k, ++next) {
      std::vector<double> error, recorded;
      for (std::size_t i = 0; i < predictions.size(); ++i) {
        const auto readings = recordings[i].sensors[s].values.row(static_cast<Eigen::Index>(k));
        for (Eigen::Index row = 0; row < predictions[i].sensors.cols(); ++row) {
          const double difference = predictions[i].sensors(next, row) - readings[row];
          if (!std::isfinite(difference)) continue;
          error.push_back(difference);
          recorded.push_back(readings[row]);
        }
      }
      const auto count = static_cast<Eigen::Index>(error.size());
      if (count == 0) continue;
      const std::string& suffix = rows[static_cast<std::size_t>(sensor.scene_row) + k].suffix;
      out.push_back(coordinate_metrics(of_scene.name + "." + suffix,
                                       Eigen::Map<const VectorX>(error.data(), count),
                                       Eigen::Map<const VectorX>(recorded.data(), count)));
    }
  }
  return out;
}

}  // namespace counterpoint::estimation
