// Recordings beside their predictions, as replays: the prediction plays, the recording is its
// ghost.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "prediction.h"
#include "view/clip.h"

namespace counterpoint::apps {

/// References are kept: all must live as long as this.
class Replays {
 public:
  Replays(const Scene& scene, const std::string& scene_file, const std::string& map,
          const std::vector<Recording>& recordings, const std::vector<Prediction>& predictions,
          Compared by);

  /// The page of the recording with the largest mean error. @throws InputError for impacts, which
  /// take no time.
  void write_worst(const std::filesystem::path& file, double rate) const;
  /// Pages of the kMost worst into a folder; their names and files. None of impacts, and none where
  /// this build makes no pages.
  std::vector<std::pair<std::string, std::string>> write_worst_of(
      const std::filesystem::path& folder, double rate) const;
  static constexpr size_t kMost = 5;

 private:
  void write(size_t recording, const std::filesystem::path& file, double rate) const;

  const Scene& scene_;
  std::string scene_file_, map_;
  const std::vector<Recording>& recordings_;
  const std::vector<Prediction>& predictions_;
  bool impacts_;
  std::vector<size_t> worst_first_;
};

}  // namespace counterpoint::apps
