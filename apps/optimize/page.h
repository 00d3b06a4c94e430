// Results of optimize, as a folder with one HTML page: --report DIR.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "optimize/run.h"
#include "report/chart.h"

namespace counterpoint::apps {

/// Forces and heights of a motion over time, from the inverse.
struct MotionFigures {
  std::vector<double> time;                ///< of steps [s]
  std::vector<std::string> links;          ///< that touch something in some step
  std::vector<std::vector<double>> force;  ///< by link and step: normal force [N]
  std::vector<double> effort;              ///< by step: largest share of an effort limit
};
MotionFigures motion_figures(const optimization::ProblemFile& problem,
                             const optimization::Result& result);

/// Writes DIR/index.html, iterations.csv, motion.csv and charts. replay: a page beside it, or
/// empty. @throws InputError where the folder cannot be written.
void write_optimization_page(const std::filesystem::path& folder,
                             const optimization::ProblemFile& problem,
                             const std::vector<OptimizedStart>& starts, std::size_t best,
                             const std::string& replay);

}  // namespace counterpoint::apps
