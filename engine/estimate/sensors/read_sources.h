// Reads sensors from a table.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

/// Sets the readings of the sensors with this source name, at these times [s]; leaves others
/// unchanged.
void read_readings(const Table& table, const ColumnMap& map, const std::string& source,
                   const std::vector<double>& time, std::vector<SensorReadings>& out);

}  // namespace counterpoint::estimation
