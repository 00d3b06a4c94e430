// Many independent problems over all cores: steps of many states, trajectories and their inverses;
// lists of numbered tasks that the caller runs where it likes.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
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

// ---- Independent, numbered tasks, for studies and for searches from many starts.

namespace tasks {

/// Result of a task, as bytes (BytesWriter) that can travel between processes and be stored in
/// files.
struct Outcome {
  std::string bytes;
  /// False if the task was stopped early (Ctrl-C). It then counts as not done, and is not stored.
  bool finished = true;
};

/// A pure function of the task number: the same number gives the same bits in every thread, process
/// and machine. It may keep a workspace. An exception ends the run.
using Task = std::function<Outcome(std::int64_t number)>;

/// Tasks 0 ... count - 1. A task is defined by its number alone until it begins: there is no list
/// of tasks.
struct TaskList {
  std::string name;  ///< plural noun for the tasks, "rollouts": in progress bars and file names
  std::int64_t count = 0;
  /// Called once in each working thread, concurrently.
  std::function<Task()> make_task;
  /// Number of tasks that this process has done, including fractions of running ones, for progress
  /// bars. Empty: whole tasks are counted.
  std::function<double()> work = {};
  /// Hash of everything that the results depend on; stored results with another one are rejected.
  std::uint64_t fingerprint = 0;
};

/// Results by number; empty for tasks that were not done, partial for a task that was stopped. Code
/// that consists of task lists takes a ListRunner and need not know where they run: in this thread
/// (run_here), on all cores, or on several machines.
using ListResults = std::vector<std::optional<std::string>>;
using ListRunner = std::function<ListResults(const TaskList&)>;

/// Runs the tasks in this thread, in order of number, until one is stopped.
inline ListResults run_here(const TaskList& list) {
  ListResults results(static_cast<std::size_t>(list.count));
  const Task task = list.make_task();
  for (std::int64_t i = 0; i < list.count; ++i) {
    Outcome outcome = task(i);
    if (!outcome.bytes.empty()) results[static_cast<std::size_t>(i)] = std::move(outcome.bytes);
    if (!outcome.finished) break;
  }
  return results;
}

// Results of tasks as bytes, in the order in which they are written, for processes on machines of
// the same byte order and type sizes.

class BytesWriter {
 public:
  template <class T>
  BytesWriter& put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  BytesWriter& text(std::string_view value) {
    put(static_cast<std::uint64_t>(value.size()));
    bytes_.append(value);
    return *this;
  }
  BytesWriter& numbers(const double* values, std::size_t count) {
    return text({reinterpret_cast<const char*>(values), count * sizeof(double)});
  }
  BytesWriter& numbers(const VectorX& values) {
    return numbers(values.data(), static_cast<std::size_t>(values.size()));
  }
  BytesWriter& numbers(const std::vector<double>& v) { return numbers(v.data(), v.size()); }
  /// Writes the number of items, and each item by put_one(writer, item).
  template <class Items, class PutOne>
  BytesWriter& list(const Items& items, PutOne put_one) {
    put(static_cast<std::uint64_t>(items.size()));
    for (const auto& item : items) put_one(*this, item);
    return *this;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what BytesWriter wrote. Every function @throws InputError if the bytes end too early.
class BytesReader {
 public:
  explicit BytesReader(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  T get() {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    T value{};
    std::memcpy(&value, next(sizeof value), sizeof value);
    return value;
  }
  std::string_view text() {
    const auto size = static_cast<std::size_t>(get<std::uint64_t>());
    return {next(size), size};
  }
  std::vector<double> numbers() {
    const std::string_view part = text();
    std::vector<double> values(part.size() / sizeof(double));
    if (!values.empty()) std::memcpy(values.data(), part.data(), values.size() * sizeof(double));
    return values;
  }
  VectorX vector() {
    const std::vector<double> values = numbers();
    return Eigen::Map<const VectorX>(values.data(), static_cast<Eigen::Index>(values.size()));
  }
  std::string string() { return std::string(text()); }
  /// Reads a list of BytesWriter::list, each item by get_one(reader).
  template <class GetOne>
  auto list(GetOne get_one) {
    std::vector<decltype(get_one(*this))> items;
    for (auto count = get<std::uint64_t>(); count > 0; --count) items.push_back(get_one(*this));
    return items;
  }
  bool empty() const { return bytes_.empty(); }

 private:
  const char* next(std::size_t size) {
    if (bytes_.size() < size) throw InputError("the result of a task is cut short");
    const char* at = bytes_.data();
    bytes_.remove_prefix(size);
    return at;
  }
  std::string_view bytes_;
};

}  // namespace tasks

}  // namespace counterpoint
