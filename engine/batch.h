// Many independent problems of one scene over all cores: steps of many states and their inverses.
#pragma once

#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/simulator.h"

namespace counterpoint {

// ---- Number of threads that this process may keep busy.

/// Returns the numbers of the processors in the affinity mask of this process (taskset, mpirun
/// --bind-to, Slurm); all processors of the machine if the system does not report a mask.
std::vector<int> affinity_cores();

/// Returns the number of processors that control groups (containers, Slurm, systemd) grant this
/// process; infinity if there is no limit. root: folder of the group files; membership: text of
/// /proc/self/cgroup. Every group from that of the process up to the root may set a limit, in
/// version 2 by cpu.max, in version 1 by cpu.cfs_quota_us and cpu.cfs_period_us.
double cgroup_cores(const std::filesystem::path& root, const std::string& membership);
double cgroup_cores();  ///< Returns the value for this process.

/// Returns the number of threads that neither share a processor nor are throttled: the number of
/// processors in the affinity mask, at most the whole processors that control groups grant; at
/// least 1.
int available_cores();
/// Returns a number of threads: `wanted`, or available_cores() for 0.
int num_threads_of(int wanted);

// ---- Many independent problems of one scene, over all cores.

/// Output of derivatives for many steps: block i of each array, nv x nv in column-major order,
/// begins at i nv nv; force i (nv) at i nv. Null: not computed. Names and units as in
/// InverseDerivatives and ForwardDerivatives (derivatives.h).
struct InverseDerivativeBlocks {
  double* applied_force = nullptr;  ///< u [N, N m]
  double *dq = nullptr, *dv = nullptr, *dv_next = nullptr;
  char* by_differences = nullptr;  ///< one per step (InverseDerivatives)
};
struct ForwardDerivativeBlocks {
  double *dv_dq = nullptr, *dv_dv = nullptr, *dv_du = nullptr;
  double *dq_dq = nullptr, *dq_dv = nullptr, *dq_du = nullptr;
};

/// Threads that share the definition of a scene, each with its own simulator. A step is a pure
/// function of its arguments, so results are bitwise those of one thread, for any number of
/// threads.
class Batch {
 public:
  /// @param num_threads  0: one per core that this process may use (available_cores)
  explicit Batch(const Scene& scene, int num_threads = 0);

  int num_threads() const { return static_cast<int>(simulators_.size()); }
  const Model& model() const { return simulators_.front().model(); }
  /// Sets the options or settings of every simulator for all tasks that follow.
  void set_options(const SimulationOptions& options);
  void set_settings(const contact::Settings& settings);

  /// Calls task(i, simulator) once for every i = 0 ... count - 1, in no particular order. The
  /// simulator is as the last task left it: a task sets state and input before it steps. It may
  /// write only to its own results (results[i]).
  /// @throws the exception of the lowest failed i after all threads have ended; after an exception
  /// no further tasks are begun.
  void run(int count, const std::function<void(int, Simulator&)>& task);

  /// Does one step of every state, in place, with its input. A state whose step fails is unchanged.
  /// @throws InputError unless all three have the same length.
  void step(std::span<State> states, std::span<const Input> inputs, std::span<StepReport> reports);

  /// Calls step_inverse_derivatives for every step from starts[i] to ends[i] (uses v of `ends`, and
  /// q where step_inverse_derivatives does), with the known input known[i]; `known` may be empty
  /// for no known inputs. NaN where forces are not known.
  /// @throws InputError unless all have the same length, and where step_inverse does.
  void inverse_derivatives(std::span<const State> starts, std::span<const State> ends,
                           std::span<const Input> known, const InverseDerivativeBlocks& out,
                           DerivativeMethod method = DerivativeMethod::kAnalytic);
  /// Calls step_forward_derivatives in the same way, including the derivatives of the inverse that
  /// they are computed from. NaN where du/dv+ is singular.
  void forward_derivatives(std::span<const State> starts, std::span<const State> ends,
                           std::span<const Input> known, const InverseDerivativeBlocks& inverse,
                           const ForwardDerivativeBlocks& out,
                           DerivativeMethod method = DerivativeMethod::kAnalytic);

 private:
  /// Workspace and results of derivatives for one thread.
  struct Derivation;
  void run_threads(int count, const std::function<void(int, size_t)>& task);
  void derive(std::span<const State> starts, std::span<const State> ends,
              std::span<const Input> known, const InverseDerivativeBlocks& inverse,
              const ForwardDerivativeBlocks* forward, DerivativeMethod method);

  std::vector<Simulator> simulators_;
  std::vector<std::shared_ptr<Derivation>> derivations_;  ///< per thread, created at first use
};

}  // namespace counterpoint
