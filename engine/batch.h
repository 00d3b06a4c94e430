// Many independent problems of one scene, over all cores: states stepped, trajectories run or
// inverted.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step_derivatives.h"

namespace counterpoint {

/// Where derivatives of many steps go: block i of each, nv x nv column by column, begins i nv nv
/// numbers on, force i (nv) i nv on. Null: not wanted.
struct InverseDerivativeBlocks {
  double* applied_force = nullptr;  ///< u [N, N m]
  double *dq = nullptr, *dv = nullptr, *dv_next = nullptr;
  char* by_differences = nullptr;  ///< one a step (InverseDerivatives)
};
struct ForwardDerivativeBlocks {
  double *dv_dq = nullptr, *dv_dv = nullptr, *dv_du = nullptr;
  double *dq_dq = nullptr, *dq_dv = nullptr, *dq_du = nullptr;
};

/// Threads that share a scene's definition, each with a simulator of its own. A step is a pure
/// function of its arguments, so the results are those of one thread, to the bit, whatever the
/// number of threads.
class Batch {
 public:
  /// @param num_threads  0: one for every core that this process may use (cores.h)
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

  /// step_inverse_derivatives of every step from starts[i] to ends[i] (whose v is looked at, and q
  /// where step_inverse_derivatives does), under known[i];
  /// `known` may be empty: nothing is known of any. NaN where forces are not known.
  /// @throws InputError unless all are of one length, and where step_inverse does.
  void inverse_derivatives(std::span<const State> starts, std::span<const State> ends,
                           std::span<const Input> known, const InverseDerivativeBlocks& out,
                           DerivativeMethod method = DerivativeMethod::kAnalytic);
  /// step_forward_derivatives alike, with those of the inverse that they come from. NaN where
  /// du/dv+ is singular.
  void forward_derivatives(std::span<const State> starts, std::span<const State> ends,
                           std::span<const Input> known, const InverseDerivativeBlocks& inverse,
                           const ForwardDerivativeBlocks& out,
                           DerivativeMethod method = DerivativeMethod::kAnalytic);

 private:
  /// What a thread finds derivatives with.
  struct Derivation;
  void run_threads(int count, const std::function<void(int, size_t)>& task);
  void derive(std::span<const State> starts, std::span<const State> ends,
              std::span<const Input> known, const InverseDerivativeBlocks& inverse,
              const ForwardDerivativeBlocks* forward, DerivativeMethod method);

  std::vector<Simulator> simulators_;
  std::vector<std::shared_ptr<Derivation>> derivations_;  ///< by thread, once asked for
};

}  // namespace counterpoint
