// Recordings beside their predictions, as replays: the prediction plays, the recording is its
// ghost.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "recordings/estimation.h"
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
  /// Numbers of the recordings by falling mean error.
  const std::vector<size_t>& worst_first() const { return worst_first_; }
  /// Impacts take no time, and some builds make no pages: then there is nothing to write.
  bool can_write() const;

  /// The page of one. @throws InputError as replay_page.
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
