// Where the steps of a run go: a trajectory, a table of sensors and a replay, written while the run
// goes on.
#pragma once

#include <memory>
#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"
#include "report/sensor_log.h"
#include "view/clip.h"
#include "view/view_option.h"

namespace counterpoint::apps {

/// Destinations of the steps of a run, each only if requested.
struct RunOutputs {
  /// file: the trajectory to write; empty: none. columns: its inputs beside applied forces. The
  /// scene must outlive the outputs. @throws InputError when the file cannot be created.
  RunOutputs(const std::string& file, const view::ViewOption& view, const Scene& scene,
             const InputColumns& columns);

  bool any() const { return writer || sensors || recorder; }
  /// Adds a step of length h [s], a hook of run_simulation and run_control.
  void step(const State& before, const Input& input, double h, const State& after,
            const StepReport& report);

  std::unique_ptr<TrajectoryWriter> writer;
  std::unique_ptr<SensorLog> sensors;  ///< set by the caller
  std::unique_ptr<view::ClipRecorder> recorder;
  Input known;  ///< input of the last step, with its softening and taut links
};

}  // namespace counterpoint::apps
