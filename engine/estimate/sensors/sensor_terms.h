// The sensors of a recording as terms of an estimate.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

namespace counterpoint::estimation {

/// Terms, and the unknown constants that they name: offsets of sensors, delays of sources.
struct SensorTerms {
  std::vector<SensorTerm> terms;
  std::vector<SensorConstant> constants;
};

/// @param h  interval of frames [s]
/// @throws InputError naming a sensor that has no readings.
SensorTerms sensor_terms(const Model& model, const ColumnMap& map, const Recording& recording,
                         double h);

/// The same without those that tell positions, but where they tell a delay.
SensorTerms without_positions(const SensorTerms& all);

}  // namespace counterpoint::estimation
