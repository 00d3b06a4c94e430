// Options that select where tasks run, the same in every command that consists of tasks.
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

/// Thrown by all ranks if the command cannot write its result yet: tasks are missing, or only a
/// share was requested. `merge` or the same command again writes it.
struct Incomplete {
  Results results;
  std::string name;       ///< name of the list
  bool followed = false;  ///< later lists need all results of this one
};

class TaskArguments {
 public:
  /// Adds --threads, --tasks and --parts. `parts_help`: text for --parts; empty: the default text.
  void add_to(Command& command, const std::string& parts_help = "");

  /// Sets the folder of finished tasks if --parts is not given: beside the output file.
  void default_parts(const std::string& folder);

  /// Runs `work` on every rank; only rank 0 writes results and prints. An error of any rank ends
  /// all of them, and rank 0 throws it. Returns the result of `work` on rank 0, 0 on others. After
  /// Incomplete rank 0 writes the report and prints the progress.
  int in_world(Report& report, const std::function<int(World&)>& work);

  /// @throws InputError for an invalid --tasks, or if it is given without a folder
  RunSettings settings(std::function<bool()> stop = {}) const;
  /// Runs the list. With a folder, first writes the command line into it, for `merge`.
  Results run(World& world, const TaskList& list, std::function<bool()> stop = {},
              bool everywhere = false) const;
  /// Runs the last list of a command. @throws Incomplete if no result can be written: for a share,
  /// or if tasks are missing, unless the run was stopped and `partial` results are useful.
  Results run_last(World& world, const TaskList& list, std::function<bool()> stop,
                   bool partial) const;

  /// True if only one share of several runs; then no result is written.
  bool is_share() const { return !share_.empty(); }
  /// Threads of this rank.
  int threads(const World& world) const { return threads_ > 0 ? threads_ : world.cores(); }
  /// Sets the number of threads of each rank.
  void set_threads(int threads) { threads_ = threads; }

 private:
  void keep_command_line() const;
  int explain(const Incomplete& incomplete, Report& report) const;

  int threads_ = 0;
  std::string share_, parts_;
  bool join_ = false;
};

/// Runs the lists of a command one after another, with results on all ranks. A list may depend on
/// the results of earlier lists and is the same on every rank. @throws Incomplete if a list that
/// was not stopped is incomplete, so that the next one cannot start.
class RunSeries {
 public:
  /// `last`: name of the final list.
  RunSeries(const TaskArguments& arguments, World& world, std::function<bool()> stop,
            std::string last)
      : arguments_(arguments), world_(world), stop_(std::move(stop)), last_name_(std::move(last)) {}
  ListResults run(const TaskList& list);
  ListRunner runner() {
    return [this](const TaskList& list) { return run(list); };
  }
  /// Call after the last list, before anything is written. @throws Incomplete for a share, since
  /// `merge` writes the result.
  void finish() const;
  const Results& last() const { return last_; }  ///< results of the previous list

 private:
  const TaskArguments& arguments_;
  World& world_;
  std::function<bool()> stop_;
  std::string last_name_;
  Results last_;
};

/// Adds ranks, threads, tasks and times of a run to a report (docs/reference/json-reports.md).
void add_run(const Results& results, Report& report);

/// Command line that filled a folder of finished tasks, without its share, and its working
/// directory. @throws InputError if there is none.
struct KeptCommand {
  std::vector<std::string> words;  ///< arguments without the program's name
  std::string folder;
};
KeptCommand kept_command(const std::filesystem::path& parts);

}  // namespace counterpoint::apps::tasks
