// Results of optimize as a folder with one HTML page, for --report DIR.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "optimize/run.h"
#include "report/chart.h"

namespace counterpoint::apps {

/// Forces of a motion over time, computed by the inverse.
struct MotionMetrics {
  std::vector<double> time;                ///< start times of the steps [s]
  std::vector<std::string> links;          ///< links that touch something in some step
  std::vector<std::vector<double>> force;  ///< normal force by link and step [N]
  std::vector<double> effort;              ///< largest share of an effort limit, by step
};
MotionMetrics motion_metrics(const optimization::ProblemFile& problem,
                             const optimization::Result& result);

/// Writes DIR/index.html, iterations.csv, motion.csv and charts. replay: page beside it, or empty.
/// @throws InputError if the folder cannot be written.
void write_optimization_page(const std::filesystem::path& folder,
                             const optimization::ProblemFile& problem,
                             const std::vector<OptimizedStart>& starts, std::size_t best,
                             const std::string& replay);

}  // namespace counterpoint::apps
