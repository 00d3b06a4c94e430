// The parts of a scene file that say what things look like: poses, surfaces, shapes. Private to
// scene_yaml.
#pragma once

#include <filesystem>
#include <string>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// `name` as a path, relative to `folder` unless absolute.
std::filesystem::path resolved(const std::filesystem::path& folder, const std::string& name);

/// Runs `action`; an error without a place in the scene file gets that of `value`.
template <typename Action>
auto located(const YamlValue& value, Action action) {
  try {
    return action();
  } catch (const InputError& error) {
    value.fail(error.what());
  }
}

/// `position` [m] with `rpy` [rad] or `quaternion` (w x y z).
Pose read_pose(const YamlValue& in);

/// `material` with what the map gives.
Material read_material(const YamlValue& in, Material material);

/// The one shape key of a map: sphere, box, capsule, cylinder, mesh, triangle_mesh or height_field.
Shape read_shape(const YamlValue& in, const std::filesystem::path& folder, HullCache& hulls);

}  // namespace counterpoint
