// Closures in a scene file. Private to scene_yaml.
#pragma once

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Reads an item of `closures` (docs/reference/scene-format.md, Closures).
ClosureSpec read_closure(const YamlValue& in);

}  // namespace counterpoint
