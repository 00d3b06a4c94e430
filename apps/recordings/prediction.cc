#include "prediction.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "median.h"

namespace counterpoint::apps {
namespace {

/// From one row to the next. False if a step failed.
bool predict_row(Simulator& simulator, const ColumnMap& map, const Recording& recording, int row,
                 const PredictionOptions& options, Prediction& out) {
  const double interval = row_interval(map, recording, row);
  const int substeps = options.substeps.value_or(
      std::max(1, static_cast<int>(std::lround(interval / options.scene_step))));
  simulator.options().time_step = interval / substeps;
  simulator.input().applied_force = recording.applied_force.col(row);
  for (int k = 0; k < substeps; ++k) {
    const StepReport step = simulator.step();
    out.newton_iterations += step.newton_iterations;
    if (!step.succeeded()) out.failure = {out.steps, simulator.state().time, step};
    ++out.steps;
    if (out.failure) return false;
  }
  return true;
}

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
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    result.joints += std::abs(q[entry.index] - recorded[entry.index]);
    ++joints;
  }
  result.joints /= std::max(joints, 1);
  return result;
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
  for (const Body& body : model.bodies()) {
    if (body.tree < 0 || body.joint_type != JointType::kFloating) continue;
    state.v.segment<3>(body.v_index) += 0.5 * interval * model.gravity();
  }
  return state;
}

Prediction predict(Simulator& simulator, const ColumnMap& map, const Recording& recording,
                   const PredictionOptions& options) {
  const Model& model = simulator.model();
  const int rows = recording.num_rows();
  const int horizon = options.horizon > 0 ? options.horizon : rows - 1;
  Prediction out;
  out.file = recording.file;
  out.rows = rows;
  out.q = recording.q;
  int pieces = 0;
  for (int start = 0; start + 1 < rows; start += horizon) {
    simulator.set_state(recorded_state(model, map, recording, start));
    const int last = std::min(start + horizon, rows - 1);
    for (int row = start; row < last; ++row) {
      if (!predict_row(simulator, map, recording, row, options, out)) return out;
      out.q.col(row + 1) = simulator.state().q;
      out.time.push_back(recording.time[row + 1]);
      out.deviations.push_back(
          deviation(model, map, simulator.state().q, recording.q.col(row + 1)));
      out.mean += out.deviations.back();
    }
    out.end += out.deviations.back();
    ++pieces;
  }
  out.mean = out.mean * (1.0 / (rows - 1));
  out.end = out.end * (1.0 / pieces);
  return out;
}

std::vector<std::pair<const char*, double>> figures(const Prediction& p, bool pose) {
  if (!pose) return {{"joint_error_mean", p.mean.joints}, {"joint_error_end", p.end.joints}};
  return {{"position_error_mean_m", p.mean.position},
          {"rotation_error_mean_deg", p.mean.rotation},
          {"position_error_end_m", p.end.position},
          {"rotation_error_end_deg", p.end.rotation}};
}

std::vector<std::pair<const char*, double>> median_figures(
    const std::vector<Prediction>& predictions, bool pose) {
  std::vector<std::pair<const char*, double>> medians;
  for (size_t i = 0; !predictions.empty() && i < figures(predictions[0], pose).size(); ++i) {
    std::vector<double> values;
    for (const Prediction& prediction : predictions)
      if (!prediction.failure) values.push_back(figures(prediction, pose)[i].second);
    if (!values.empty())
      medians.emplace_back(figures(predictions[0], pose)[i].first, median(values));
  }
  return medians;
}

}  // namespace counterpoint::apps
