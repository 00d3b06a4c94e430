// Entries of `sensors` in a scene file. Private to scene_yaml.
#pragma once

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Reads one sensor (docs/reference/sensors.md).
SensorSpec read_sensor(const YamlValue& in);

}  // namespace counterpoint
