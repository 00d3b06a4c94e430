// The sensors of a recording as terms of a motion estimate.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

namespace counterpoint::estimation {

/// Terms, and the unknown constants they refer to: offsets of sensors and delays of sources.
struct SensorTerms {
  std::vector<SensorTerm> terms;
  std::vector<SensorConstant> constants;
};

/// @param h  interval of frames [s]
/// @throws InputError naming a sensor without readings.
SensorTerms sensor_terms(const Model& model, const ColumnMap& map, const Recording& recording,
                         double h);

/// Removes position sensors, except those that determine an unknown delay.
SensorTerms without_positions(const SensorTerms& all);

}  // namespace counterpoint::estimation
