// The readings of a sensor as a function of time.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"

namespace counterpoint::estimation {

/// A reading: the first reading_size numbers; the others are zero.
using Reading = Eigen::Vector4d;

/// Readings with linear interpolation, and their time integrals.
class SensorSignal {
 public:
  /// @param interval  interval of frames [s]
  SensorSignal(const Sensor& sensor, const SensorReadings& readings, double interval);

  /// Interpolates at `time` [s]. Returns false if no reading is near.
  bool read(double time, Reading& out) const;
  /// Computes the reading that corresponds to frame t at `time`, for frames h [s] apart. Angular
  /// velocity: mean over the interval before. Forces and accelerations: mean over both adjacent
  /// intervals with triangular weights. Others: the value at the time, or the mean over h around it
  /// if readings come faster than frames.
  bool read_frame(double time, double h, Reading& out) const;
  /// Standard deviation of a component of read_frame, from the given one of a reading, or from the
  /// white noise of the readings (third differences). 0 if there are too few readings.
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
  std::vector<Reading> values_;  ///< valid readings
  std::vector<Reading> integral_,
      second_integral_;    ///< single and double time integral up to each reading
  std::vector<int> gaps_;  ///< number of gaps before each reading
  double spacing_ = 0.0;   ///< median interval [s]
  double deviation_ = 0.0;
};

}  // namespace counterpoint::estimation
