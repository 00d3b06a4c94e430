// Actuators in a scene file. Private to scene_yaml.
#pragma once

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Reads an item of `actuators` (docs/reference/actuators.md).
ActuatorSpec read_actuator(const YamlValue& in);

}  // namespace counterpoint
