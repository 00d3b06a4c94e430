// Tendons in a scene file. Private to scene_yaml.
#pragma once

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Reads an item of `tendons` (docs/reference/scene-format.md, Tendons).
TendonSpec read_tendon(const YamlValue& in);

}  // namespace counterpoint
