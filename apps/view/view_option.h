// The option --view FILE of commands that make a motion: writes a replay of it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "view/clip.h"
#include "view/replay.h"

namespace counterpoint::apps {
class Command;
}

namespace counterpoint::view {

/// Files from which a motion came: the scene's (empty: it was built in memory), and others, which
/// need not exist.
struct Origin {
  std::string scene_file;
  std::vector<std::string> inputs;
  std::map<std::string, std::filesystem::path> packages = {};     ///< see SceneOverrides
  std::vector<std::pair<std::string, std::string>> remarks = {};  ///< keys and values to show
};

/// Makes a replay that contains its input files and origin.
Replay make_replay(const Scene& scene, const Origin& origin, Clip clip, std::vector<Clip> ghosts);
/// Writes a replay that contains its input files and origin. @throws InputError as replay_page, and
/// if the file cannot be written.
void write_replay(const std::filesystem::path& file, const Scene& scene, const Origin& origin,
                  Clip clip, std::vector<Clip> ghosts = {});

class ViewOption {
 public:
  void add_to(apps::Command& command);
  bool wanted() const { return !file_.empty(); }
  /// Finds errors before the computation starts. @throws InputError.
  void check() const;
  const std::string& file() const { return file_; }
  double rate() const { return rate_; }

 private:
  std::string file_;
  double rate_ = kDefaultRate;
};

}  // namespace counterpoint::view
