// Many independent problems over all cores: states of a scene stepped, trajectories run or
// inverted; lists of numbered tasks that a caller runs where it likes.
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

// ---- How many threads this process may keep busy.

/// The processors, by number, that the affinity of this process lets its threads run on (taskset,
/// mpirun --bind-to, Slurm); those of the machine where the system does not say.
std::vector<int> affinity_cores();

/// Processors' worth of time that control groups (containers, Slurm, systemd) grant this process;
/// infinity where there is no limit. `root`: where their files are; `membership`: the text of
/// /proc/self/cgroup. Every group from that of the process up to the root may limit it, in version
/// 2 by cpu.max, in version 1 by cpu.cfs_quota_us and cpu.cfs_period_us.
double cgroup_cores(const std::filesystem::path& root, const std::string& membership);
double cgroup_cores();  ///< of this process

/// Threads that neither wait for one another's processor nor are throttled: the processors of the
/// affinity, at most the whole ones that control groups grant; 1 at least.
int available_cores();

// ---- Many independent problems of one scene, over all cores: states stepped, trajectories run or
// inverted.

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
  /// @param num_threads  0: one for every core that this process may use (available_cores)
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

// ---- Independent, numbered tasks: what a study or a search from many starts is made of.

namespace tasks {

/// What a task gave, as bytes (BytesWriter): they travel between processes and lie in files.
struct Outcome {
  std::string bytes;
  /// False: it was stopped on its way (Ctrl-C). It counts as not done, and is not kept on disk.
  bool finished = true;
};

/// A pure function of the number of a task: the same number gives the same bits in every thread,
/// process and machine. It may keep a workspace. What it throws ends the run.
using Task = std::function<Outcome(std::int64_t number)>;

/// Tasks 0 ... count - 1. A number is all that is known of a task until it is begun: there is no
/// list of them.
struct TaskList {
  std::string name;  ///< of what they are, "rollouts": in progress bars and names of files
  std::int64_t count = 0;
  /// Called once in each thread that works, by several at a time.
  std::function<Task()> make_task;
  /// What this process has done, in tasks, those under way in part; for progress bars. Empty: whole
  /// tasks are counted.
  std::function<double()> work = {};
  /// Of all that results depend on: who keeps results refuses those of another one.
  std::uint64_t fingerprint = 0;
};

/// Results by number; none of a task that was not done, what it had by then of one that was stopped
/// on its way. Code that is made of lists of tasks takes a function that runs them, and need not
/// know where: in this thread (run_here), over cores, or over machines.
using ListResults = std::vector<std::optional<std::string>>;
using ListRunner = std::function<ListResults(const TaskList&)>;

/// In this thread, in order of number, until one is stopped.
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

// Results of tasks as bytes, in the order in which they are written; for processes on machines of
// one kind.

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
  /// How many, and each as put_one(writer, item) has it.
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

/// Every function @throws InputError where the bytes end before what is asked for.
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
  /// What BytesWriter::list wrote, each by get_one(reader).
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
