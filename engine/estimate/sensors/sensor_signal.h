// The readings of a sensor as a function of time.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"

namespace counterpoint::estimation {

/// A reading: reading_size numbers, the others zero.
using Reading = Eigen::Vector4d;

class SensorSignal {
 public:
  /// Readings that come faster than frames are averaged over intervals of `interval` [s].
  SensorSignal(const Sensor& sensor, const SensorReadings& readings, double interval);

  /// Interpolated between the readings around `time` [s]. False where none is near.
  bool read(double time, Reading& out) const;
  /// What a sensor of this kind says of frame t at `time`, frames being h [s] apart: angular
  /// velocities as the mean over the interval before, forces and accelerations as the mean with the
  /// weights of a triangle over both intervals beside it, all others at the time itself.
  bool read_frame(double time, double h, Reading& out) const;
  /// Standard deviation of a component of read_frame: as given, or that of white noise in the
  /// readings, found from their third differences. 0 where there are too few readings.
  double deviation() const { return deviation_; }

 private:
  double found_deviation() const;

  SensorKind kind_;
  std::vector<double> time_;      ///< [s]
  std::vector<Reading> values_;   ///< those that are there
  double spacing_ = 0.0;          ///< median interval [s]
  double deviation_ = 0.0;
};

}  // namespace counterpoint::estimation
