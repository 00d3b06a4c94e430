// The optimization of a problem file, and the output of its results.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/feedback.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/optimize/retarget.h"
#include "counterpoint/engine/trajectory.h"
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

/// Calls step(before, input, h, after) for each step of a motion whose frames are h [s] apart, a
/// Result or RepeatedMotion; returns the last state.
template <class Motion, class Step>
State for_each_step(const Motion& motion, double h, const Step& step) {
  Input input;
  State state{0.0, motion.q[0], motion.v[0]};
  for (std::size_t t = 0; t + 1 < motion.q.size(); ++t) {
    input.applied_force = motion.applied_force[t];
    const State next{static_cast<double>(t + 1) * h, motion.q[t + 1], motion.v[t + 1]};
    step(state, input, h, next);
    state = next;
  }
  return state;
}

/// Writes a motion, whose frames are h [s] apart, as a trajectory
/// (docs/reference/trajectory-format.md).
template <class Motion>
void write_motion(const std::string& file, const Model& model, double h, const Motion& motion) {
  TrajectoryWriter writer(file, model);
  writer.write_end(for_each_step(
      motion, h, [&](const State& state, const Input& input, double step, const State&) {
        writer.write_step(state, input, step);
      }));
}

/// @throws InputError if the file is not JSON
Json read_json(const std::string& file);

/// Frames of a trajectory as an initial guess: unchanged if their number fits, else interpolated
/// along the motion. If the duration is free, the problem gets the time step of the trajectory.
/// @throws InputError as read_trajectory
std::vector<VectorX> frames_from(const std::string& file, optimization::Problem& problem);

/// Writes a fit as a trajectory without forces.
void write_fit(const std::string& file, const optimization::ProblemFile& problem,
               const optimization::Fit& fit);
/// Writes the figures of a fit, and of a motion's deviation from it
/// (docs/reference/json-reports.md).
void fill_fit(const optimization::Fit& fit, const optimization::ProblemFile& problem,
              const OptimizedStart& start, Json& out);
/// Prints them.
void print_fit(Report& report);

/// Writes the figures of a start (docs/reference/json-reports.md).
void fill_report(const OptimizedStart& start, Json& out);

/// Writes one row for each Newton step.
void write_iterations(const std::string& file, const optimization::Result& result);

}  // namespace counterpoint::apps
