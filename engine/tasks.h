// Independent, numbered tasks, for studies and for searches from many starts. The caller runs a
// list of them where it likes: in one thread, on all cores, or on several machines.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace counterpoint {

namespace tasks {

/// Result of a task, as bytes that can travel between processes and be stored in files.
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

}  // namespace tasks

}  // namespace counterpoint
