// Pictures of a replay for documents, drawn by Chromium without a window.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace counterpoint::view {

struct Pictures {
  std::vector<double> times;                ///< [s], one PNG each
  std::optional<std::vector<double>> gif;   ///< start [s], end [s], frames a second
  std::optional<std::vector<double>> webm;  ///< alike
  int width = 960, height = 540;            ///< [pixels]
  std::string link;                         ///< further settings, as in a page's fragment
  bool any() const { return !times.empty() || gif || webm; }
};

/// The files of images, in the order of `times`, then the GIF and the video.
struct Drawn {
  std::vector<std::string> png;
  std::string gif, webm;
};

/// chromium, chromium-browser or google-chrome on the path; or COUNTERPOINT_CHROMIUM of the
/// environment. Empty where there is none.
std::string find_chromium();

/// Opens a page and reads what it drew (page/capture.js); meanwhile waiting, if there is one, is
/// called ten times a second: false ends it, and nothing is drawn. @throws InputError where there
/// is no Chromium, std::runtime_error where it drew nothing, or has no encoder for video.
Drawn draw(const std::filesystem::path& page, const Pictures& pictures,
           const std::function<bool()>& waiting = {});

}  // namespace counterpoint::view
