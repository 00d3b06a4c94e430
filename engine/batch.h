// Many independent problems of one scene, over all cores: states stepped, trajectories run or
// inverted.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "counterpoint/engine/simulator.h"

namespace counterpoint {

/// Threads that share a scene's definition, each with a simulator of its own. A step is a pure
/// function of its arguments, so the results are those of one thread, to the bit, whatever the
/// number of threads.
class Batch {
 public:
  /// @param num_threads  0: one for every core
  explicit Batch(const Scene& scene, int num_threads = 0);

  int num_threads() const { return static_cast<int>(simulators_.size()); }
  const Model& model() const { return simulators_.front().model(); }
  /// Of every simulator; a setting changed here holds for all tasks that follow.
  void set_options(const SimulationOptions& options);
  void set_settings(const contact::Settings& settings);

  /// Calls task(i, simulator) once for every i = 0 ... count - 1, in no particular order. The
  /// simulator is as the last task left it: a task sets state and input before it steps. What it
  /// writes must be its own (results[i]).
  /// @throws what the task of lowest i threw, after all threads have ended; tasks not yet begun
  /// when one throws are left out.
  void run(int count, const std::function<void(int, Simulator&)>& task);

  /// One step of every state, in place, under its input. A state whose step fails stays as it was.
  /// @throws InputError unless all three are of one length.
  void step(std::span<State> states, std::span<const Input> inputs, std::span<StepReport> reports);

 private:
  std::vector<Simulator> simulators_;
};

}  // namespace counterpoint
