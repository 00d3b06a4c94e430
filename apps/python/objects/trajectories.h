// Motions in memory.
#pragma once

#include "counterpoint/engine/motion_files.h"
#include "handles.h"

namespace counterpoint::python {

/// Never changed once made: its arrays are views.
struct TrajectoryHandle {
  ModelPtr model;
  ScenePtr scene;  ///< where it is known: what a replay shows
  Trajectory trajectory;
};
using TrajectoryPtr = std::shared_ptr<TrajectoryHandle>;

/// Takes a motion step by step.
class MotionRecorder {
 public:
  MotionRecorder(const Model& model, InputColumns columns, size_t steps);
  void step(const State& before, const Input& input, double h, const Softening& softening,
            const State& after);
  /// The last state. Row k of the trajectory is where step k starts.
  Trajectory finish(const State& last);

 private:
  void add(const State& state);
  const Model& model_;
  InputColumns columns_;
  std::vector<double> time_, h_, q_, v_, force_, known_;
  std::vector<Softening> softening_;
  std::vector<std::vector<TautLink>> taut_links_;
};

}  // namespace counterpoint::python
