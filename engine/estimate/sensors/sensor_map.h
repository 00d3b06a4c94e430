// The sensors of a column map (docs/reference/recording-format.md, Sensors).
#pragma once

#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/estimate/sensors/map_nodes.h"

namespace counterpoint::estimation {

/// Fills the sources and sensors of `map` from the keys `sources`, `sensors` and `markers` of
/// `root`. @throws InputError naming file, line, key, what was expected.
void read_sensors(const MapNodes& nodes, const YAML::Node& root, ColumnMap& map);

/// The name of a source that `map` has; empty where there is no node.
std::string source_name(const MapNodes& nodes, const YAML::Node& node, const ColumnMap& map);

}  // namespace counterpoint::estimation
