#include "counterpoint/engine/estimate/sensors/sensor_signal.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/motion/motion_filter.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {
namespace {

/// Readings farther apart than so many intervals have a gap between them.
constexpr double kGapIntervals = 1.5;
/// A reading counts as one of the time asked for that is within this share of an interval.
constexpr double kSameTime = 1e-3;
/// No sensor is surer than this, by kind [m, rad, rad/s, m/s^2, N, N m].
double least_deviation(SensorKind kind) {
  switch (kind) {
    case SensorKind::kAngularVelocity: return 1e-3;
    case SensorKind::kSpecificForce: return 1e-2;
    case SensorKind::kContactForce: return 0.1;
    case SensorKind::kJointForce: return 1e-3;
    default: return 1e-5;
  }
}

/// The square sum of the weights with which read_frame takes readings at the rate of frames.
double noise_share(SensorKind kind) {
  switch (kind) {
    case SensorKind::kAngularVelocity: return 0.5;           // 1/2, 1/2
    case SensorKind::kSpecificForce:
    case SensorKind::kJointForce:
    case SensorKind::kContactForce: return 18.0 / 36.0;      // 1/6, 4/6, 1/6
    default: return 1.0;
  }
}

double median_interval(const std::vector<double>& time) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < time.size(); ++i) intervals.push_back(time[i] - time[i - 1]);
  return intervals.empty() ? 0.0 : median(intervals);
}

}  // namespace

SensorSignal::SensorSignal(const Sensor& sensor, const SensorReadings& readings, double interval)
    : kind_(sensor.kind) {
  const double spacing = median_interval(readings.time);
  const int bin = spacing > 0.0 ? std::max(1, static_cast<int>(interval / spacing + 0.1)) : 1;
  double time = 0.0;
  Reading sum = Reading::Zero();
  int count = 0;
  for (Eigen::Index row = 0; row < readings.values.cols(); ++row) {
    const auto column = readings.values.col(row);
    if (!column.allFinite()) {
      count = 0;
      continue;
    }
    Reading value = Reading::Zero();
    value.head(column.size()) = column;
    if (kind_ == SensorKind::kOrientation) {
      if (!(value.norm() > 0.0)) continue;
      value.normalize();
      if (!values_.empty() && value.dot(values_.back()) < 0.0) value = -value;
    }
    const double at = readings.time[static_cast<std::size_t>(row)];
    if (count == 0) {
      sum.setZero();
      time = 0.0;
    }
    sum += value;
    time += at;
    if (++count < bin) continue;
    time_.push_back(time / bin);
    values_.push_back(sum / bin);
    count = 0;
  }
  spacing_ = median_interval(time_);
  deviation_ = std::isfinite(sensor.deviation) ? sensor.deviation / std::sqrt(bin)
                                               : std::max(found_deviation(), least_deviation(kind_));
  deviation_ *= std::sqrt(noise_share(kind_));
}

double SensorSignal::found_deviation() const {
  double sum = 0.0;
  const int size = reading_size(kind_);
  for (int k = 0; k < size; ++k) {
    VectorX series(static_cast<Eigen::Index>(values_.size()));
    for (std::size_t i = 0; i < values_.size(); ++i)
      series[static_cast<Eigen::Index>(i)] = values_[i][k];
    const double one = white_noise(series);
    sum += one * one;
  }
  // A rotation vector is about twice the vector part of a quaternion's change.
  const double scale = kind_ == SensorKind::kOrientation ? 4.0 : 1.0;
  return std::sqrt(scale * sum / error_size(kind_));
}

bool SensorSignal::read(double time, Reading& out) const {
  if (time_.size() < 2) return false;
  const double slack = kSameTime * spacing_;
  const auto it = std::lower_bound(time_.begin(), time_.end(), time - slack);
  if (it == time_.end()) return false;
  const auto after = static_cast<std::size_t>(it - time_.begin());
  if (time_[after] <= time + slack) {
    out = values_[after];
    return true;
  }
  if (after == 0) return false;
  const double interval = time_[after] - time_[after - 1];
  if (interval > kGapIntervals * spacing_) return false;
  const double share = (time - time_[after - 1]) / interval;
  out = (1.0 - share) * values_[after - 1] + share * values_[after];
  if (kind_ == SensorKind::kOrientation) out.normalize();
  return true;
}

bool SensorSignal::read_frame(double time, double h, Reading& out) const {
  Reading before, behind;
  switch (kind_) {
    case SensorKind::kAngularVelocity:
      if (!read(time, out) || !read(time - h, before)) return false;
      out = 0.5 * (out + before);
      return true;
    case SensorKind::kSpecificForce:
    case SensorKind::kContactForce:
    case SensorKind::kJointForce:
      if (!read(time, out) || !read(time - h, before) || !read(time + h, behind)) return false;
      out = (before + 4.0 * out + behind) / 6.0;
      return true;
    default: return read(time, out);
  }
}

}  // namespace counterpoint::estimation
