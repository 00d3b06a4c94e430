// Trajectories in memory.
#pragma once

#include "counterpoint/engine/trajectory.h"
#include "handles.h"

namespace counterpoint::python {

/// A trajectory that never changes, since its arrays are views.
struct TrajectoryHandle {
  ModelPtr model;
  ScenePtr scene;  ///< for replays, if known
  Trajectory trajectory;
};
using TrajectoryPtr = std::shared_ptr<TrajectoryHandle>;

/// Records a motion step by step.
class MotionRecorder {
 public:
  MotionRecorder(const Model& model, InputColumns columns, size_t steps);
  void step(const State& before, const Input& input, double h, const Softening& softening,
            const State& after);
  /// Adds the last state and returns the trajectory. Row k is the start of step k.
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
