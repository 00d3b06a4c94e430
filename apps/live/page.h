// The page of a live session: that of a replay with one frame, and controls.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "live/inputs/sliders.h"
#include "live/picture.h"

namespace counterpoint::live {

/// The controls of a session as JSON (docs/reference/live.md, Messages): sliders, and the words of
/// each setting.
std::string controls_of(const std::vector<Slider>& sliders);
/// The controls of a page that only watches.
std::string watching_controls();

struct PageSource {
  const Scene& scene;
  const State& state;
  std::string file;                                            ///< the scene's; empty: none
  std::map<std::string, std::filesystem::path> packages = {};  ///< see SceneOverrides
};

/// Returns the page. curves: those whose values come with frames, as Picture::curves; sources:
/// those to which it may connect (Server). @throws InputError if this build has no pages.
std::string live_page(const PageSource& source, std::vector<view::Curve> curves,
                      const std::string& controls, const std::string& sources);

}  // namespace counterpoint::live
