// How a command that is made of tasks is told where to run them: the same options in each.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "run_tasks.h"

namespace counterpoint::apps {
class Command;
class Report;
}  // namespace counterpoint::apps

namespace counterpoint::apps::tasks {

/// Thrown, by all ranks alike, where what a command writes is left to `merge` or to the same
/// command run again: tasks are not done, or only a share of them was to be.
struct Incomplete {
  Results results;
  std::string name;       ///< of the list
  bool followed = false;  ///< other lists, that need all of this one, come after it
};

class TaskArguments {
 public:
  /// --threads, --tasks, --parts. `parts_help`: of --parts; empty: the default text.
  void add_to(Command& command, const std::string& parts_help = "");

  /// The folder of finished tasks where --parts is not given: beside a file that is written.
  void default_parts(const std::string& folder);

  /// Runs a command's work, on every rank alike, which ends with rank 0 alone writing. Ranks other
  /// than 0 say nothing, but for how they died. What a rank throws ends all of them; rank 0 throws
  /// it. Returns what `work` does on rank 0, elsewhere 0. After Incomplete rank 0 writes the report
  /// and says how far the tasks are.
  int in_world(Report& report, const std::function<int(World&)>& work);

  /// @throws InputError for a --tasks that is none, or without a folder.
  RunSettings settings(std::function<bool()> stop = {}) const;
  /// Runs the list. With a folder, the command line is written into it first, for `merge`.
  Results run(World& world, const TaskList& list, std::function<bool()> stop = {},
              bool everywhere = false) const;
  /// Runs the last list of a command. @throws Incomplete where nothing is to be written of it: of a
  /// share, and where tasks are missing, unless it was stopped and `partial` results are of use.
  Results run_last(World& world, const TaskList& list, std::function<bool()> stop,
                   bool partial) const;

  /// One share of several was to be run: no result is written.
  bool is_share() const { return !share_.empty(); }
  /// Threads of this rank.
  int threads(const World& world) const { return threads_ > 0 ? threads_ : world.cores(); }
  /// Leaves so many threads of each rank to every task.
  void set_threads(int threads) { threads_ = threads; }

 private:
  void keep_command_line() const;
  int explain(const Incomplete& incomplete, Report& report) const;

  int threads_ = 0;
  std::string share_, parts_;
  bool join_ = false;
};

/// Runs the lists of a command one after the other, with results on all ranks: what a list is may
/// depend on the results of those before it, and is the same on every rank. @throws Incomplete
/// where a list that was not stopped is not complete, so that the next one cannot begin.
class RunSeries {
 public:
  /// `last`: name of the list after which no other comes.
  RunSeries(const TaskArguments& arguments, World& world, std::function<bool()> stop,
            std::string last)
      : arguments_(arguments), world_(world), stop_(std::move(stop)), last_name_(std::move(last)) {}
  ListResults run(const TaskList& list);
  ListRunner runner() {
    return [this](const TaskList& list) { return run(list); };
  }
  /// After the last list, before anything is written. @throws Incomplete of a share: `merge`
  /// writes.
  void finish() const;
  const Results& last() const { return last_; }  ///< of the list that was run last

 private:
  const TaskArguments& arguments_;
  World& world_;
  std::function<bool()> stop_;
  std::string last_name_;
  Results last_;
};

/// Adds ranks, threads, tasks and times of a run to a report (docs/reference/json-reports.md).
void add_run(const Results& results, Report& report);

/// The command line that the folder of finished tasks came from, without its share, and the folder
/// that it ran in. @throws InputError where there is none.
struct KeptCommand {
  std::vector<std::string> words;  ///< without the program
  std::string folder;
};
KeptCommand kept_command(const std::filesystem::path& parts);

}  // namespace counterpoint::apps::tasks
