// Replays that show recordings beside their predictions: the prediction plays, the recording is its
// ghost.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "recordings/estimation.h"
#include "view/clip.h"

namespace counterpoint::apps {

/// Keeps references: all arguments must outlive the object.
class Replays {
 public:
  Replays(const Scene& scene, const std::string& scene_file, const std::string& map,
          const std::vector<Recording>& recordings, const std::vector<Prediction>& predictions,
          Compared by);

  /// Writes the page of the recording with the largest mean error. @throws InputError for impacts,
  /// which have no duration.
  void write_worst(const std::filesystem::path& file, double rate) const;
  /// Indices of the recordings by decreasing mean error.
  const std::vector<size_t>& worst_first() const { return worst_first_; }
  /// False for impacts, which have no duration, and for builds without pages.
  bool can_write() const;

  /// Writes the page of one recording. @throws InputError as replay_page.
  void write(size_t recording, const std::filesystem::path& file, double rate) const;

 private:
  const Scene& scene_;
  std::string scene_file_, map_;
  const std::vector<Recording>& recordings_;
  const std::vector<Prediction>& predictions_;
  bool impacts_;
  std::vector<size_t> worst_first_;
};

}  // namespace counterpoint::apps
