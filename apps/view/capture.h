// Pictures of a replay for documents, drawn by Chromium without a window.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace counterpoint::view {

struct Pictures {
  std::vector<double> times;                ///< times of the PNG pictures [s]
  std::optional<std::vector<double>> gif;   ///< start [s], end [s], frames per second
  std::optional<std::vector<double>> webm;  ///< same as gif
  int width = 960, height = 540;            ///< [pixels]
  std::string link;                         ///< further settings, as in a page's fragment
  bool any() const { return !times.empty() || gif || webm; }
};

/// The image files: PNGs in the order of `times`, the GIF and the video.
struct Drawn {
  std::vector<std::string> png;
  std::string gif, webm;
};

/// Returns COUNTERPOINT_CHROMIUM of the environment, or chromium, chromium-browser or google-chrome
/// on the path; empty if there is none.
std::string find_chromium();

/// Opens a page and reads the pictures that it drew (page/capture.js). Calls `waiting`, if given,
/// ten times a second; if it returns false, nothing is drawn. @throws InputError if there is no
/// Chromium, std::runtime_error if it drew nothing or has no video encoder.
Drawn draw(const std::filesystem::path& page, const Pictures& pictures,
           const std::function<bool()>& waiting = {});

}  // namespace counterpoint::view
