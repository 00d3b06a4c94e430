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
};

/// package://NAME/..., model://NAME/..., file://..., absolute, or relative to the URDF. A package
/// that is not listed is looked for upwards from the URDF: a folder NAME first, then folders that
/// hold the end of the path. @throws InputError (with `where`) telling where was looked.
MeshPath find_mesh(const std::string& name, const std::filesystem::path& urdf_folder,
                   const std::map<std::string, std::filesystem::path>& packages,
                   const std::string& where);

}  // namespace counterpoint
