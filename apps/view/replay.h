// A replay: one self-contained HTML file that plays a motion (docs/reference/replay.md).
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "view/clip.h"
#include "view/curves.h"
#include "view/visuals.h"

namespace counterpoint::view {

/// A file from which the motion was made, or the motion itself; readers can save it from the page.
struct InputFile {
  std::string name;
  std::string bytes;
};

struct Replay {
  std::string title;
  const Scene* scene = nullptr;
  Clip clip;
  std::vector<Clip> ghosts;   ///< other motions of the scene, shown one at a time
  std::vector<Curve> curves;  ///< shown before those of the motion, with a value per frame of it
  Visuals visuals;
  std::vector<std::pair<std::string, std::string>> made;  ///< keys and values on the replay's
                                                          ///< origin
  std::vector<InputFile> inputs;
  /// Controls of a live page (apps/live) as JSON, and the sources to which it may connect. Such a
  /// page has no curves but `curves`.
  std::string controls, connect_to;
};

/// Units of the packed values; rounding errors are at most half of them.
struct Resolution {
  double position = 0.0;                ///< [m]
  double quaternion = 1.0 / (1 << 15);  ///< for each component
  double force = 0.0;                   ///< [N]
};
Resolution resolution_of(const Replay& replay);
Resolution resolution_of(const Model& model, const Clip& clip);

/// Returns the data of the page as JSON without any '<' (docs/reference/replay.md, Format). @throws
/// InputError if a body is farther than 1e9 m from the origin or its pose is not finite.
std::string replay_data(const Replay& replay);

/// Returns one motion of a scene as JSON: `motion`, an entry of `motions` in replay_data, and the
/// `contacts`, `closure_forces`, `curves` and `shown_curves` that belong to it. @throws InputError
/// as replay_data.
nlohmann::ordered_json motion_data(const Scene& scene, const Clip& clip);

/// True if this build has the page's program; why_no_pages() gives the reason if not, and the
/// remedy.
bool can_make_pages();
std::string why_no_pages();

/// Returns the whole page. @throws InputError as replay_data, and if can_make_pages is false.
std::string replay_page(const Replay& replay);

/// Writes a file completely or not at all. @throws InputError if it cannot be written.
void write_whole(const std::filesystem::path& file, const std::string& bytes);

}  // namespace counterpoint::view
