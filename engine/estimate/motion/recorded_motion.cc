#include "counterpoint/engine/estimate/motion/recorded_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/engine/estimate/sensors/pose_fit.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Lower bound of the noise of a recording [m, rad].
constexpr double kLeastNoise = 1e-5;
/// Noise assumed in the search for spikes is at least this, the deviation of an encoder's steps [m,
/// rad].
constexpr double kLeastDamage = 1e-4;
/// Spikes are larger than this number of standard deviations of noise,
constexpr double kDamage = 12.0;
/// and larger than this number of steps of the neighbouring motion, which may be an impact.
constexpr double kFast = 3.0;

/// Returns the median interval of the rows [s], and whether all intervals are close to it.
std::pair<double, bool> spacing(const Recording& recording) {
  std::vector<double> intervals;
  for (std::size_t row = 1; row < recording.time.size(); ++row)
    intervals.push_back(recording.time[row] - recording.time[row - 1]);
  const double h = median(intervals);
  const bool even = std::all_of(intervals.begin(), intervals.end(), [&](double interval) {
    return std::abs(interval - h) <= kUneven * h;
  });
  return {h, even};
}

/// Sets `measured` (nv) to 0 for missing cells of a row; any missing component drops an
/// orientation.
void leave_out_missing(const Model& model, const Recording& recording, Eigen::Index row,
                       Eigen::Ref<VectorX> measured) {
  if (recording.missing.size() == 0) return;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const int positions = joint_nq(body.joint_type), velocities = joint_nv(body.joint_type);
    const int linear = positions == velocities ? velocities : joint_num_linear(body.joint_type);
    for (int k = 0; k < positions; ++k) {
      if (recording.missing(body.q_index + k, row) == 0.0) continue;
      if (k < linear)
        measured[body.v_index + k] = 0.0;
      else
        measured.segment(body.v_index + linear, velocities - linear).setZero();
    }
  }
}

/// Resamples to rows `h` [s] apart, interpolated linearly between recorded rows.
void resample(const Model& model, const Recording& recording, double h, const VectorX& recorded,
              RecordedMotion& out) {
  const std::vector<double>& time = recording.time;
  const int rows = 1 + static_cast<int>(std::floor((time.back() - time.front()) / h + 1e-9));
  out.measured.resize(model.nv(), rows);
  out.force.resize(model.nv(), rows);
  std::size_t before = 0;
  for (int row = 0; row < rows; ++row) {
    const double t = time.front() + h * row;
    while (before + 2 < time.size() && time[before + 1] <= t) ++before;
    const double interval = time[before + 1] - time[before];
    const double share = std::clamp((t - time[before]) / interval, 0.0, 1.0);
    const auto column = static_cast<Eigen::Index>(before);
    out.time.push_back(t);
    out.frames.push_back(
        moved(model, recording.q.col(column),
              share * difference(model, recording.q.col(column), recording.q.col(column + 1))));
    out.force.col(row) = (1.0 - share) * recording.applied_force.col(column) +
                         share * recording.applied_force.col(column + 1);
    const bool gap = interval > kGap * h && share > 0.0 && share < 1.0;
    out.measured.col(row) = gap ? VectorX(VectorX::Zero(model.nv())) : recorded;
    if (recording.missing.size() == 0) continue;
    for (const Eigen::Index at : {column, column + 1})
      if (at == column ? share < 1.0 : share > 0.0)
        leave_out_missing(model, recording, at, out.measured.col(row));
  }
}

/// Rejects spikes: values off the lines through the two rows before and through the two rows after,
/// by similar amounts. Smooth motions and bounces lie on one of these lines.
void leave_out_spikes(const Model& model, RecordedMotion& motion) {
  const MatrixX d = steps_of(model, motion.frames);
  for (int row = 2; row + 2 < motion.rows(); ++row) {
    VectorX by = VectorX::Zero(model.nv());
    for (int i = 0; i < model.nv(); ++i) {
      const double left = d(i, row - 1) - d(i, row - 2), right = d(i, row + 1) - d(i, row);
      const double least = std::min(std::abs(left), std::abs(right));
      const double speed = std::max(std::abs(d(i, row - 2)), std::abs(d(i, row + 1)));
      if (motion.measured(i, row) == 0.0 || left * right <= 0.0 ||
          least <=
              kDamage * std::sqrt(6.0) * std::max(motion.noise[i], kLeastDamage) + kFast * speed)
        continue;
      // At a spike both lines miss by its height, and the second difference is twice that,
      // opposite.
      const double bend = d(i, row) - d(i, row - 1);
      if (bend * left >= 0.0 || std::abs(bend) < 1.5 * least) continue;
      by[i] = -0.5 * (left + right);
      motion.spikes.push_back({row, i, -by[i], std::abs(by[i]) / motion.noise[i]});
      motion.measured(i, row) = 0.0;
    }
    if (!by.isZero(0.0)) {
      VectorX& q = motion.frames[static_cast<std::size_t>(row)];
      q = moved(model, q, by);
    }
  }
}

/// Adds the sensor terms and the coordinates that only sensors measure.
void add_sensors(const Model& model, const ColumnMap& map, const Recording& recording,
                 const VectorX& recorded, RecordedMotion& out) {
  out.by_sensors = VectorX::Zero(model.nv());
  if (map.sensors.empty()) return;
  out.sensors = sensor_terms(model, map, recording, out.h());
  const std::vector<SensorTerm>& terms = out.sensors.terms;
  if (std::none_of(terms.begin(), terms.end(),
                   [](const SensorTerm& term) { return is_position(term.sensor.kind); }))
    return;
  FittedPoses poses = fit_poses(model, terms, out.time.front(), out.h(), out.frames, recorded);
  out.frames = std::move(poses.frames);
  out.measured = out.measured.cwiseMax(poses.seen);
  for (int i = 0; i < model.nv(); ++i)
    out.by_sensors[i] = recorded[i] == 0.0 && poses.seen.row(i).any() ? 1.0 : 0.0;
}

}  // namespace

std::vector<char> recorded_coordinates(const Model& model, const ColumnMap& map) {
  std::vector<char> q(static_cast<std::size_t>(model.nq()), 0);
  std::vector<char> out(static_cast<std::size_t>(model.nv()), 0);
  for (const ColumnMap::Entry& entry : map.entries)
    if (entry.kind == ColumnMap::Entry::Kind::kPosition && !entry.source.column.empty())
      q[static_cast<std::size_t>(entry.index)] = 1;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const int positions = joint_nq(body.joint_type), velocities = joint_nv(body.joint_type);
    const int linear = joint_num_linear(body.joint_type);
    for (int k = 0; k < velocities; ++k) {
      bool any = false;
      const bool own = positions == velocities || k < linear;
      for (int j = own ? k : linear; j < (own ? k + 1 : positions); ++j)
        any = any || q[static_cast<std::size_t>(body.q_index + j)] != 0;
      out[static_cast<std::size_t>(body.v_index + k)] = any ? 1 : 0;
    }
  }
  return out;
}

VectorX given(const VectorX& deviation, int nv) {
  return deviation.size() == nv ? deviation : VectorX(VectorX::Constant(nv, kInfinity));
}

RecordedMotion prepare(const Model& model, const ColumnMap& map, const Recording& recording) {
  refuse_inputs(map, "explain");
  if (recording.num_rows() < kLeastRows)
    throw InputError(fmt::format("{}: {} rows; {} or more are expected to explain a motion",
                                 recording.file, recording.num_rows(), kLeastRows));
  const std::vector<char> coordinates = recorded_coordinates(model, map);
  VectorX recorded(model.nv());
  for (int i = 0; i < model.nv(); ++i)
    recorded[i] = coordinates[static_cast<std::size_t>(i)] != 0 ? 1.0 : 0.0;
  RecordedMotion out;
  const auto [h, even] = spacing(recording);
  out.resampled = !even;
  if (even) {
    out.time = recording.time;
    for (int row = 0; row < recording.num_rows(); ++row) out.frames.push_back(recording.q.col(row));
    out.measured = recorded.replicate(1, recording.num_rows());
    for (int row = 0; row < recording.num_rows(); ++row)
      leave_out_missing(model, recording, row, out.measured.col(row));
    out.force = recording.applied_force;
  } else {
    resample(model, recording, h, recorded, out);
  }
  add_sensors(model, map, recording, recorded, out);
  if (out.measured.isZero(0.0))
    throw InputError(recording.file +
                     ": the column map names no position; a motion is explained from positions");
  out.noise = white_noise(model, out.frames).cwiseMax(kLeastNoise);
  const VectorX known = given(map.position_deviation, model.nv());
  for (int i = 0; i < model.nv(); ++i)
    if (std::isfinite(known[i])) out.noise[i] = known[i];
  leave_out_spikes(model, out);
  return out;
}

RecordedMotion part(const RecordedMotion& whole, int first, int count) {
  RecordedMotion out;
  out.time.assign(whole.time.begin() + first, whole.time.begin() + first + count);
  out.frames.assign(whole.frames.begin() + first, whole.frames.begin() + first + count);
  out.measured = whole.measured.middleCols(first, count);
  out.force = whole.force.middleCols(first, count);
  out.noise = whole.noise;
  out.by_sensors = whole.by_sensors;
  out.sensors = whole.sensors;
  return out;
}

}  // namespace counterpoint::estimation
