// Estimated motions as HTML pages: --report DIR of `explain`.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "recordings/motion_metrics.h"
#include "recordings/motion_tables.h"
#include "report/chart.h"

namespace counterpoint::apps {

/// Files from which a page was made.
struct MotionOrigin {
  std::string scene_file, map;
  std::map<std::string, std::filesystem::path> packages = {};  ///< see SceneOverrides
};

/// Charts of contact forces over recorded ones, joint forces, unexplained force, and cost by row;
/// bands reach two standard deviations to either side.
std::vector<Chart> explained_charts(const ExplainedMotions& motions, std::size_t index,
                                    const ExplainedMetrics& metrics);

/// Writes DIR/index.html, its charts as SVG files, and a replay of each recording if this build can
/// make pages. @throws InputError if the folder cannot be written.
void write_motion_page(const std::filesystem::path& folder, const MotionOrigin& origin,
                       const ExplainedMotions& motions,
                       const std::vector<ExplainedMetrics>& metrics);

}  // namespace counterpoint::apps
