// A replay: one HTML file that shows a motion, with all that it needs (docs/reference/replay.md).
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "view/clip.h"
#include "view/visuals.h"

namespace counterpoint::view {

/// A file that the motion was made from, or the motion; it can be saved from the page.
struct InputFile {
  std::string name;
  std::string bytes;
};

struct Replay {
  std::string title;
  const Scene* scene = nullptr;
  Clip clip;
  std::vector<Clip> ghosts;  ///< other motions of the scene; one at a time is shown
  Visuals visuals;
  std::vector<std::pair<std::string, std::string>> made;  ///< what made it: key, value
  std::vector<InputFile> inputs;
};

/// Errors of the packed poses are at most half of these.
struct Resolution {
  double position = 0.0;                ///< [m]
  double quaternion = 1.0 / (1 << 15);  ///< of each component
  double force = 0.0;                   ///< [N]
};
Resolution resolution_of(const Replay& replay);

/// What the page shows, as JSON (docs/reference/replay.md, Format), in which no '<' occurs. @throws
/// InputError where a body is farther than 1e9 m from the origin, or its pose is not finite.
std::string replay_data(const Replay& replay);

/// Is the page's program part of this build? If not, why, and what to do.
bool can_make_pages();
std::string why_no_pages();

/// The whole page. @throws InputError as replay_data, and where can_make_pages is false.
std::string replay_page(const Replay& replay);

/// Writes a file anew, or not at all. @throws InputError if it cannot be written.
void write_whole(const std::filesystem::path& file, const std::string& bytes);

}  // namespace counterpoint::view
