// The files that a scene is read from, to be kept in a replay.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "view/replay.h"

namespace counterpoint::view {

/// Files larger than this when packed are named, but not kept [bytes].
inline constexpr size_t kMaxPackedInput = 1'200'000;

/// Collects files by path, each once.
class InputFiles {
 public:
  /// Takes a file; one that cannot be read, or is too large, is left out.
  void add(const std::filesystem::path& file);
  /// A scene (.yaml or .urdf), the robots, meshes and heights that it names.
  void add_scene(const std::filesystem::path& file, const Model& model);

  std::vector<InputFile> files;
  std::vector<std::string> left_out;  ///< "name (size)"

 private:
  std::vector<std::filesystem::path> seen_;
};

/// This process as a shell would be told to run it again; "" where the system does not say.
std::string command_line();

/// Key and value of what every replay says of its origin: command, version, scene, hashes.
std::vector<std::pair<std::string, std::string>> made_by(const std::string& scene_file,
                                                         const Scene& scene, const Clip& clip);

}  // namespace counterpoint::view
