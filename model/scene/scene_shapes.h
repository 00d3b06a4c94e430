// Poses, surface materials and shapes in scene files. Private to scene_yaml.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Returns `name` as a path, relative to `folder` unless it is absolute.
std::filesystem::path resolved(const std::filesystem::path& folder, const std::string& name);

/// Runs `action`; an InputError is rethrown with the place of `value` in the scene file.
template <typename Action>
auto located(const YamlValue& value, Action action) {
  try {
    return action();
  } catch (const InputError& error) {
    value.fail(error.what());
  }
}

/// Reads two numbers, the first not larger; either may be `none`, without bound, if `open`.
std::pair<double, double> read_range(const YamlValue& in, bool open);

/// Reads `position` [m] with `rpy` [rad] or `quaternion` (w x y z).
Pose read_pose(const YamlValue& in);

/// Keys of a surface, those of read_material.
inline constexpr const char* kSurfaceKeys[] = {
    "friction",           "friction_axis",    "static_friction", "stribeck_speed", "restitution",
    "torsional_friction", "rolling_friction", "stiffness",       "damping",        "dissipation",
    "stiffness_per_area", "damping_per_area", "surface_velocity"};

/// Throws for a surface_velocity where it is not that of a shape.
void refuse_surface_velocity(const YamlValue& in);

/// Throws if a surface or pair has both a stiffness of a point and one per area.
void expect_one_stiffness(const YamlValue& in);

/// Sliding friction of a map: `friction: mu`, or `friction: [along, across]` with `friction_axis`.
struct FrictionGiven {
  double along = 0.0, across = 0.0;  ///< [-]
  Vector3 axis = Vector3::Zero();
};
/// Returns nothing without `friction`.
std::optional<FrictionGiven> read_friction(const YamlValue& in);
/// Refuses a `static_friction` below the friction of sliding [-].
void expect_static_friction(const YamlValue& in, double friction);
/// Returns `material` with the values that the map gives.
Material read_material(const YamlValue& in, Material material);

/// Reads `meshes: {kind, tolerance, most, files: {NAME: {kind, tolerance, most}}}`; what a file
/// does not give is that of all meshes.
MeshCollisions read_mesh_collisions(const YamlValue& in);

/// Reads the only shape key of a map: plane, sphere, box, capsule, cylinder, mesh, triangle_mesh or
/// height_field. @throws InputError if there is none, or more than one.
Shape read_shape(const YamlValue& in, const std::filesystem::path& folder, HullCache& hulls);

}  // namespace counterpoint
