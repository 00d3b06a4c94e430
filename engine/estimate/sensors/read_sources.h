// Readings of sensors from a table.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

/// The readings of the sensors whose source has this name, at these times; others stay as they are.
void read_readings(const Table& table, const ColumnMap& map, const std::string& source,
                   const std::vector<double>& time, std::vector<SensorReadings>& out);

}  // namespace counterpoint::estimation
