#include "counterpoint/engine/estimate/sensors/sensor_signal.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/series_noise.h"

namespace counterpoint::estimation {
namespace {

/// Readings more than this number of median intervals apart have a gap between them.
constexpr double kGapIntervals = 1.5;
/// Positions are averaged if their interval is below this fraction of the frame interval.
constexpr double kFaster = 0.6;
/// A reading matches a requested time within this fraction of an interval.
constexpr double kSameTime = 1e-3;
/// Lower bound of a sensor's standard deviation, by kind [m, rad, rad/s, m/s^2, N, N m].
double least_deviation(SensorKind kind) {
  switch (kind) {
    case SensorKind::kAngularVelocity:
      return 1e-3;
    case SensorKind::kSpecificForce:
      return 1e-2;
    case SensorKind::kContactForce:
    case SensorKind::kLinkForce:
      return 0.1;
    case SensorKind::kLinkTorque:
      return 1e-2;
    case SensorKind::kJointForce:
      return 1e-3;
    default:
      return 1e-5;
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
  if (!readings.time.empty()) start_ = readings.time.front();
  for (Eigen::Index row = 0; row < readings.values.cols(); ++row) {
    const auto column = readings.values.col(row);
    if (!column.allFinite()) continue;
    Reading value = Reading::Zero();
    value.head(column.size()) = column;
    if (kind_ == SensorKind::kOrientation) {
      if (!(value.norm() > 0.0)) continue;
      value.normalize();
      if (!values_.empty() && value.dot(values_.back()) < 0.0) value = -value;
    }
    time_.push_back(readings.time[static_cast<std::size_t>(row)] - start_);
    values_.push_back(value);
  }
  if (time_.size() < 2) return;
  spacing_ = median_interval(time_);
  gaps_.assign(time_.size(), 0);
  integral_.assign(time_.size(), Reading::Zero());
  second_integral_ = integral_;
  for (std::size_t k = 1; k < time_.size(); ++k) {
    gaps_[k] = gaps_[k - 1] + (time_[k] - time_[k - 1] > kGapIntervals * spacing_ ? 1 : 0);
    integral_[k] = integral(k - 1, time_[k]);
    second_integral_[k] = second_integral(k - 1, time_[k]);
  }
  const double one = std::isfinite(sensor.deviation)
                         ? sensor.deviation
                         : std::max(found_deviation(), least_deviation(kind_));
  deviation_ = one * std::sqrt(noise_share(interval));
}

/// Variance ratio of read_frame to a single reading: sum of the squared weights.
double SensorSignal::noise_share(double interval) const {
  const double readings = std::max(1.0, interval / spacing_);
  switch (kind_) {
    case SensorKind::kAngularVelocity:
      return (readings - 0.5) / (readings * readings);
    case SensorKind::kSpecificForce:
    case SensorKind::kJointForce:
    case SensorKind::kContactForce:
    case SensorKind::kLinkForce:
    case SensorKind::kLinkTorque:
      return std::min(0.5, 2.0 / (3.0 * readings));
    default:
      return spacing_ < kFaster * interval ? 1.0 / readings : 1.0;
  }
}

double SensorSignal::found_deviation() const {
  double sum = 0.0;
  const int size = reading_size(kind_);
  for (int k = 0; k < size; ++k) {
    VectorX series(static_cast<Eigen::Index>(values_.size()));
    for (std::size_t i = 0; i < values_.size(); ++i)
      series[static_cast<Eigen::Index>(i)] = values_[i][k];
    const Eigen::Index last = series.size() - 1;
    const double one = series_noise(series.tail(last) - series.head(last));
    sum += one * one;
  }
  // A rotation vector is about twice the vector part of the quaternion's change.
  const double scale = kind_ == SensorKind::kOrientation ? 4.0 : 1.0;
  return std::sqrt(scale * sum / error_size(kind_));
}

/// Index of the first reading of the interval that contains `time`.
std::size_t SensorSignal::segment(double time) const {
  const auto it = std::upper_bound(time_.begin() + 1, time_.end() - 1, time);
  return static_cast<std::size_t>(it - time_.begin()) - 1;
}

/// Returns whether there are readings without a gap from `first` to `last`.
bool SensorSignal::within(double first, double last) const {
  const double slack = kSameTime * spacing_;
  if (time_.size() < 2 || first < time_.front() - slack || last > time_.back() + slack)
    return false;
  const std::size_t k = segment(std::max(first, time_.front()) + slack);
  const std::size_t l = segment(std::min(last, time_.back()) - slack);
  return k > l || gaps_[l + 1] == gaps_[k];  // k > l: both times match the same reading
}

/// Integral up to a time in the interval after reading k.
Reading SensorSignal::integral(std::size_t k, double time) const {
  const double s = time - time_[k], h = time_[k + 1] - time_[k];
  return integral_[k] + s * values_[k] + 0.5 * s * s / h * (values_[k + 1] - values_[k]);
}

Reading SensorSignal::second_integral(std::size_t k, double time) const {
  const double s = time - time_[k], h = time_[k + 1] - time_[k];
  return second_integral_[k] + s * integral_[k] + 0.5 * s * s * values_[k] +
         s * s * s / (6.0 * h) * (values_[k + 1] - values_[k]);
}

bool SensorSignal::read(double time, Reading& out) const {
  const double at = time - start_;
  if (!within(at, at)) return false;
  const std::size_t k = segment(at);
  const double share = std::clamp((at - time_[k]) / (time_[k + 1] - time_[k]), 0.0, 1.0);
  out = (1.0 - share) * values_[k] + share * values_[k + 1];
  if (kind_ == SensorKind::kOrientation) out.normalize();
  return true;
}

bool SensorSignal::read_frame(double time, double h, Reading& out) const {
  const double at = time - start_;
  switch (kind_) {
    case SensorKind::kAngularVelocity:
      if (!within(at - h, at)) return false;
      out = (integral(at) - integral(at - h)) / h;
      return true;
    case SensorKind::kSpecificForce:
    case SensorKind::kContactForce:
    case SensorKind::kJointForce:
    case SensorKind::kLinkForce:
    case SensorKind::kLinkTorque:
      if (!within(at - h, at + h)) return false;
      out =
          (second_integral(at + h) - 2.0 * second_integral(at) + second_integral(at - h)) / (h * h);
      return true;
    default:
      if (!(spacing_ < kFaster * h) || !within(at - 0.5 * h, at + 0.5 * h)) return read(time, out);
      out = (integral(at + 0.5 * h) - integral(at - 0.5 * h)) / h;
      if (kind_ == SensorKind::kOrientation) out.normalize();
      return true;
  }
}

}  // namespace counterpoint::estimation
