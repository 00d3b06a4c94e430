// Runs a list of tasks over the cores of this process, over the ranks of MPI, or one share of it.
//
// Rank 0 hands out chunks of task numbers; a rank asks for the next chunk when few tasks remain.
// All ranks work, including rank 0. With a folder every process writes its finished tasks into a
// journal there (journal.h); otherwise the results are sent to rank 0. Results do not depend on
// which rank did a task.
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
  int threads = 0;  ///< threads of each rank; 0: all its cores
  Share share;
  std::filesystem::path folder;  ///< folder of journals; empty: results stay in memory
  bool compute = true;           ///< false: only read the journals
  /// Called from time to time; no task starts after it returns true.
  std::function<bool()> stop = {};
  bool everywhere = false;  ///< results are needed on all ranks, not only on rank 0
};

/// Results of a run, on rank 0 (and on the others if requested).
class Results {
 public:
  std::int64_t count = 0;      ///< number of all tasks
  std::int64_t finished = 0;   ///< tasks finished by this run or an earlier one
  std::int64_t computed = 0;   ///< tasks finished or stopped by this run, over all ranks
  bool stopped = false;        ///< stopped by RunSettings::stop
  double seconds = 0.0;        ///< wall time of this run [s]
  int ranks = 1, threads = 1;  ///< threads of rank 0
  bool complete() const { return finished == count; }
  /// Calls take(number, result) for the available results, in order of numbers, including tasks
  /// that were stopped before their end.
  void for_each(const std::function<void(std::int64_t, std::string&&)>& take) const;

 private:
  friend class TaskRun;
  TaskList list_;
  std::filesystem::path folder_;
  std::vector<std::optional<std::string>> kept_;  ///< results by number, without a folder
  std::vector<std::pair<std::int64_t, std::string>> stopped_tasks_;
};

/// Runs a list; all ranks call it with the same list and settings. @throws on every rank the first
/// error that reaches rank 0 (within a rank that of the lowest task number), unchanged or, with
/// several ranks, as WorldFailed; also if a journal cannot be written; InputError as JournalReader
/// does. Finished tasks stay in the journals.
Results run_tasks(World& world, const TaskList& list, const RunSettings& settings);

}  // namespace counterpoint::apps::tasks
