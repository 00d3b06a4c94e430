// URDF files through urdfdom, with a second pass over the XML for what urdfdom drops.
#pragma once

#include <filesystem>
#include <string>

#include "counterpoint/model/builder/model_parts.h"

namespace counterpoint {

/// A package not listed is searched for upwards from the URDF.
struct UrdfOptions : ModelFileOptions {
  /// Opt-in: exchanges limits whose lower is above the upper, and lets a joint go by itself that is
  /// to follow one that does not exist, is fixed or has several coordinates (or is so itself); notes
  /// each. Off: refused.
  bool repair_joints = false;
  /// For what a collision's file does not say.
  Material default_material;
};

/// Reads a URDF file. Visual elements are ignored; collision meshes become their convex hulls.
/// Friction and restitution come from Bullet's <contact>, Drake's proximity properties and Gazebo's
/// mu1. @throws InputError naming file, line or element, what was expected, what to do.
RobotSpec load_urdf(const std::filesystem::path& file, const UrdfOptions& options = {});

}  // namespace counterpoint
