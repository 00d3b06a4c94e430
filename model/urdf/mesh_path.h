// Finds the file that a mesh name in a URDF means.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace counterpoint {

struct MeshPath {
  std::filesystem::path file;
  /// The package or folder named was not found as such; the file was found by the end of its path.
  bool guessed = false;
  std::filesystem::path root = {};  ///< of a search upwards: the folder that stands for the package
};

/// package://NAME/..., model://NAME/..., file://..., absolute, or relative to the URDF. A package
/// that is not listed is looked for upwards from the URDF: a folder NAME first, then folders that
/// hold the end of the path. The file, symlinks followed, must lie in the URDF's folder, in the package
/// that this is part of (the nearest folder upwards with package.xml or model.config; without one, the
/// folder above), in a listed package, or in the folder NAME found upwards.
/// @throws InputError (with `where`) telling where was looked, or how to allow what lies elsewhere.
MeshPath find_mesh(const std::string& name, const std::filesystem::path& urdf_folder,
                   const std::map<std::string, std::filesystem::path>& packages,
                   const std::string& where);

}  // namespace counterpoint
