// --view FILE of commands that make a motion: a replay of it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "view/clip.h"
#include "view/replay.h"

namespace counterpoint::apps {
class Command;
}

namespace counterpoint::view {

/// Files that a motion came from: the scene's, and others, which may not be there.
struct Origin {
  std::string scene_file;
  std::vector<std::string> inputs;
  std::map<std::string, std::filesystem::path> packages = {};  ///< as SceneOverrides has them
};

/// Writes a replay with all that says where it came from. @throws InputError as replay_page, and
/// where the file cannot be written.
void write_replay(const std::filesystem::path& file, const Scene& scene, const Origin& origin,
                  Clip clip, std::vector<Clip> ghosts = {});

class ViewOption {
 public:
  void add_to(apps::Command& command);
  bool wanted() const { return !file_.empty(); }
  /// Refuses at once what would only fail at the end. @throws InputError.
  void check() const;
  const std::string& file() const { return file_; }
  double rate() const { return rate_; }

 private:
  std::string file_;
  double rate_ = kDefaultRate;
};

}  // namespace counterpoint::view
