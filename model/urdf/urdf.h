// URDF files through urdfdom, with a second pass over the XML for what urdfdom drops.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "counterpoint/model/mesh/mesh.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {

struct UrdfOptions {
  /// package:// roots: NAME -> folder. A package not listed is searched for upwards from the URDF.
  std::map<std::string, std::filesystem::path> packages;
  /// Opt-in: makes non-physical inertias physical (nearest one meeting the triangle inequality) and
  /// notes each. Off: they are used as they are where that can be simulated, noted, or refused.
  bool repair_inertias = false;
  /// Opt-in: exchanges limits whose lower is above the upper, and lets a joint go by itself that is
  /// to follow one that does not exist, is fixed or has several coordinates (or is so itself); notes
  /// each. Off: refused.
  bool repair_joints = false;
  /// For what a collision's file does not say.
  Material default_material;
  /// Where hulls are shared with other files; none: each file has its own.
  std::shared_ptr<HullCache> hulls;
};

/// Reads a URDF file. Visual elements are ignored; collision meshes become their convex hulls.
/// Friction and restitution come from Bullet's <contact>, Drake's proximity properties and Gazebo's
/// mu1. @throws InputError naming file, line or element, what was expected, what to do.
RobotSpec load_urdf(const std::filesystem::path& file, const UrdfOptions& options = {});

}  // namespace counterpoint
