// Estimated motions as pages: --report DIR of `explain`.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "recordings/motion_figures.h"
#include "recordings/motion_tables.h"
#include "report/chart.h"

namespace counterpoint::apps {

/// Files that a page was made from.
struct MotionOrigin {
  std::string scene_file, map;
  std::map<std::string, std::filesystem::path> packages = {};  ///< as SceneOverrides has them
};

/// Contact forces over those recorded, forces of joints, what is not explained, cost of each row;
/// bands are two standard deviations to either side.
std::vector<Chart> explained_charts(const ExplainedMotions& motions, std::size_t index,
                                    const ExplainedFigures& figures);

/// Writes DIR/index.html, its charts as SVG files, and a replay of each recording where this build
/// can make one. @throws InputError where the folder cannot be written.
void write_motion_page(const std::filesystem::path& folder, const MotionOrigin& origin,
                       const ExplainedMotions& motions,
                       const std::vector<ExplainedFigures>& figures);

}  // namespace counterpoint::apps
