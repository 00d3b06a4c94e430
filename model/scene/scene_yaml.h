// Scene files (docs/reference/scene-format.md).
#pragma once

#include "counterpoint/model/scene.h"

namespace counterpoint {

inline constexpr const char* kGroundName = "ground";

/// Reads a scene file. @throws InputError with file, line and element.
Scene load_yaml_scene(const std::filesystem::path& file, const SceneOverrides& overrides);

}  // namespace counterpoint
