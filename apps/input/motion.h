// Reading of motions and recordings in commands.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/trajectory.h"
#include "recordings/estimation.h"
#include "report/failure.h"

namespace counterpoint::apps {

/// Reads a trajectory as read_trajectory does and shows the elapsed time on the terminal.
Trajectory read_motion(const std::string& file, const Model& model);

/// How far the steps of a motion were taken.
struct MotionPass {
  int done = 0;  ///< number of steps without a fault
  std::optional<FailedStep> failed;
  bool stopped = false;  ///< ended by Ctrl-C
  /// Status of a report: "ok", "failed" or "stopped".
  const char* status() const { return failed ? "failed" : stopped ? "stopped" : "ok"; }
};

/// Calls step(k, options, known) for every step k of a motion, with its length [s] in the options
/// and its recorded targets and wrenches, until one returns a fault or Ctrl-C; shows the progress.
MotionPass for_each_step(
    const std::string& label, const Scene& scene, const Trajectory& trajectory,
    const std::vector<double>& lengths,
    const std::function<Fault(int k, const SimulationOptions& options, const Input& known)>& step);

/// Reads recordings as estimation::read_all does and prints its notes on assumptions to standard
/// error.
std::vector<Recording> read_with_notes(const std::vector<std::string>& files, const ColumnMap& map,
                                       const Scene& scene);

}  // namespace counterpoint::apps
