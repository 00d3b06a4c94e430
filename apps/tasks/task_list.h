// Independent, numbered tasks: what a sweep, a study or a search from many starts is made of.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace counterpoint::apps::tasks {

/// What a task gave, as bytes (bytes.h): they travel between processes and lie in files.
struct Outcome {
  std::string bytes;
  /// False: it was stopped on its way (Ctrl-C). It counts as not done, and is not kept on disk.
  bool finished = true;
};

/// A pure function of the number of a task: the same number gives the same bits in every thread,
/// process and machine. It may keep a workspace. What it throws ends the run (run_tasks.h).
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
  /// Of all that results depend on. Results of another one are refused (journal.h).
  std::uint64_t fingerprint = 0;
};

/// Results by number; none of a task that was not done, what it had by then of one that was stopped
/// on its way. Code that is made of lists of tasks takes a
/// function that runs them, and need not know where: RunSeries (task_arguments.h), or run_here.
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

/// Share `index` (from 0) of `of`: the tasks whose numbers leave that remainder, so that long and
/// short tasks, which tend to be neighbours, are dealt out evenly.
struct Share {
  std::int64_t index = 0, of = 1;
  bool has(std::int64_t number) const { return number % of == index; }
};

}  // namespace counterpoint::apps::tasks
