// Files from which a scene is read, to be stored in a replay.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "view/replay.h"

namespace counterpoint::view {

/// Limit on the packed size [bytes]: larger files are named but not stored.
inline constexpr size_t kMaxPackedInput = 1'200'000;

/// Collects files, each path once.
class InputFiles {
 public:
  /// Adds a file; skips one that cannot be read, and lists one that is too large in left_out.
  void add(const std::filesystem::path& file);
  /// Adds a scene (.yaml or .urdf) and the robots, meshes and heights that it names.
  void add_scene(const std::filesystem::path& file, const Model& model);

  std::vector<InputFile> files;
  std::vector<std::string> left_out;  ///< "name (size)"

 private:
  std::vector<std::filesystem::path> seen_;
};

/// Quotes a word for a shell, if it needs that.
std::string shell_word(const std::string& word);
/// Command line of this process, quoted for a shell; empty if the system does not provide it.
std::string command_line();

/// Keys and values on the origin of a replay: command, version, scene, hashes.
std::vector<std::pair<std::string, std::string>> made_by(const std::string& scene_file,
                                                         const Scene& scene, const Clip& clip);

}  // namespace counterpoint::view
