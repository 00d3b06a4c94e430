// The sensors of a column map (docs/reference/recording-format.md, Sensors).
#pragma once

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/map_nodes.h"

namespace counterpoint::estimation {

/// Sets the sources and sensors of `map` from the keys `sources`, `sensors` and `markers` of
/// `root`. @throws InputError naming file, line, key and the expected value.
void read_sensors(const MapNodes& nodes, const YAML::Node& root, ColumnMap& map);

/// Reads the name of one of the sources of `map`; empty if there is no node.
std::string source_name(const MapNodes& nodes, const YAML::Node& node, const ColumnMap& map);

}  // namespace counterpoint::estimation
