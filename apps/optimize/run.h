// The optimization of a problem file, and what is written of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"
#include "report/report.h"

namespace counterpoint::apps {

/// One start and what came of it.
struct OptimizedStart {
  std::uint64_t seed = 0;
  optimization::Result result;
  optimization::Verification verification;
  std::vector<optimization::Result> stages;  ///< of the continuation, in their order
  bool feasible() const { return result.outcome == optimization::Outcome::kConverged; }
};

/// As bytes and back, to the bit.
std::string bytes_of(const OptimizedStart& start);
OptimizedStart start_of(const std::string& bytes);

/// Feasible ones before others, then the cheaper one.
bool is_better(const OptimizedStart& a, const OptimizedStart& b);

/// Writes frames as a trajectory (docs/reference/trajectory-format.md).
void write_motion(const std::string& file, const optimization::ProblemFile& problem,
                  const optimization::Result& result);
void write_motion(const std::string& file, const optimization::ProblemFile& problem,
                  const optimization::RepeatedMotion& motion);

/// @throws InputError where the file is no JSON.
Json read_json(const std::string& file);

/// Frames of a trajectory as a start: taken as they are where their number fits, else by
/// interpolation along the motion. @throws InputError as read_trajectory.
std::vector<VectorX> frames_from(const std::string& file, const optimization::Problem& problem);

/// docs/reference/json-reports.md.
void fill_report(const OptimizedStart& start, Json& out);

/// A row for each Newton step.
void write_iterations(const std::string& file, const optimization::Result& result);

}  // namespace counterpoint::apps
