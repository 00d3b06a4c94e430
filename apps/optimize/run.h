// The optimization of a problem file, and the output of its results.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Result of the optimization from one start.
struct OptimizedStart {
  std::uint64_t seed = 0;
  optimization::Result result;
  optimization::Verification verification;
  std::vector<optimization::Result> stages;  ///< stages of the continuation, in order
  bool feasible() const { return result.outcome == optimization::Outcome::kConverged; }
};

/// Serializes a start and restores it bitwise.
std::string bytes_of(const OptimizedStart& start);
OptimizedStart start_of(const std::string& bytes);

/// Feasible starts come before others, then lower cost before higher.
bool is_better(const OptimizedStart& a, const OptimizedStart& b);

/// Writes frames as a trajectory (docs/reference/trajectory-format.md).
void write_motion(const std::string& file, const optimization::ProblemFile& problem,
                  const optimization::Result& result);
void write_motion(const std::string& file, const optimization::ProblemFile& problem,
                  const optimization::RepeatedMotion& motion);

/// @throws InputError if the file is not JSON
Json read_json(const std::string& file);

/// Frames of a trajectory as an initial guess: unchanged if their number fits, else interpolated
/// along the motion. @throws InputError as read_trajectory
std::vector<VectorX> frames_from(const std::string& file, const optimization::Problem& problem);

/// Writes the figures of a start (docs/reference/json-reports.md).
void fill_report(const OptimizedStart& start, Json& out);

/// Writes one row for each Newton step.
void write_iterations(const std::string& file, const optimization::Result& result);

}  // namespace counterpoint::apps
