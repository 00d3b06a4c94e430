// Runs a list of tasks: over the cores of this process, over the ranks of MPI, or one share of it.
//
// Rank 0 hands out chunks of numbers, a rank asks for the next one when it has little left, and all
// of them work, rank 0 too. With a folder every process keeps what it finished in a journal there
// (journal.h); without one the results travel to rank 0. Nothing depends on who did which task.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "task_list.h"
#include "world.h"

namespace counterpoint::apps::tasks {

struct RunSettings {
  int threads = 0;  ///< of each rank; 0: as many as it has cores for
  Share share;
  std::filesystem::path folder;  ///< of journals; empty: results are in memory alone
  bool compute = true;           ///< false: only what the journals have
  /// Asked for now and then: no task is begun any more once it says so.
  std::function<bool()> stop = {};
  bool everywhere = false;  ///< results are wanted on all ranks, not on rank 0 alone
};

/// What came of a run, on rank 0 (and on the others if asked for).
class Results {
 public:
  std::int64_t count = 0;      ///< of all tasks
  std::int64_t finished = 0;   ///< of these, by this run or an earlier one
  std::int64_t computed = 0;   ///< finished or stopped by this run, over all ranks
  bool stopped = false;        ///< by RunSettings::stop
  double seconds = 0.0;        ///< of this run
  int ranks = 1, threads = 1;  ///< threads: of rank 0
  bool complete() const { return finished == count; }
  /// take(number, result) of those that there are, in order of number; those that were stopped on
  /// their way among them.
  void for_each(const std::function<void(std::int64_t, std::string&&)>& take) const;

 private:
  friend class TaskRun;
  TaskList list_;
  std::filesystem::path folder_;
  std::vector<std::optional<std::string>> kept_;  ///< by number, of a run without folder
  std::vector<std::pair<std::int64_t, std::string>> stopped_tasks_;
};

/// All ranks call it with the same list and settings. @throws on every rank what the task of lowest
/// number threw on rank 0 first, as WorldFailed (run by more than one rank) or as it was; where a
/// journal cannot be written; InputError as JournalReader does. What was finished stays in the
/// journals.
Results run_tasks(World& world, const TaskList& list, const RunSettings& settings);

}  // namespace counterpoint::apps::tasks
