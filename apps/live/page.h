// The page of a live session: that of a replay with one frame, and controls.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "live/picture.h"

namespace counterpoint::live {

/// The controls of a session as JSON (docs/reference/live.md, Messages): sliders for servos and
/// motors, and the words of each setting.
std::string controls_of(const Model& model);
/// Values of its sliders, in their order: targets by Model::servos, and forces (nv).
std::vector<double> slider_values(const Model& model, const VectorX& targets,
                                  const VectorX& forces);
/// The controls of a page that only watches.
std::string watching_controls();

struct PageSource {
  const Scene& scene;
  const State& state;
  std::string file;                                            ///< the scene's; empty: none
  std::map<std::string, std::filesystem::path> packages = {};  ///< see SceneOverrides
};

/// Returns the page. sources: those to which it may connect (Server). @throws InputError if this
/// build has no pages.
std::string live_page(const PageSource& source, Picture& picture, const std::string& controls,
                      const std::string& sources);

}  // namespace counterpoint::live
