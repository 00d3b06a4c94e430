// The readings of a sensor as a function of time.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"

namespace counterpoint::estimation {

/// A reading: reading_size numbers, the others zero.
using Reading = Eigen::Vector4d;

/// Readings joined by straight lines, and their integrals.
class SensorSignal {
 public:
  /// @param interval  of frames [s]
  SensorSignal(const Sensor& sensor, const SensorReadings& readings, double interval);

  /// Interpolated between the readings around `time` [s]. False where none is near.
  bool read(double time, Reading& out) const;
  /// The reading that belongs to frame t at `time`, frames being h [s] apart: angular
  /// velocities as the mean over the interval before, forces and accelerations as the mean with the
  /// weights of a triangle over both intervals beside it, all others at the time itself, or as the
  /// mean over h about it where readings come faster than frames.
  bool read_frame(double time, double h, Reading& out) const;
  /// Standard deviation of a component of read_frame: from that of a reading as given, or that of
  /// white noise in the readings, found from their third differences. 0 where there are too few.
  double deviation() const { return deviation_; }

 private:
  double found_deviation() const;
  double noise_share(double interval) const;
  std::size_t segment(double time) const;
  bool within(double first, double last) const;
  Reading integral(std::size_t k, double time) const;
  Reading second_integral(std::size_t k, double time) const;
  Reading integral(double time) const { return integral(segment(time), time); }
  Reading second_integral(double time) const { return second_integral(segment(time), time); }

  SensorKind kind_;
  double start_ = 0.0;           ///< origin of all times below [s]
  std::vector<double> time_;     ///< [s]
  std::vector<Reading> values_;  ///< those that are there
  std::vector<Reading> integral_,
      second_integral_;    ///< up to each reading, over time once and twice
  std::vector<int> gaps_;  ///< gaps before each reading
  double spacing_ = 0.0;   ///< median interval [s]
  double deviation_ = 0.0;
};

}  // namespace counterpoint::estimation
