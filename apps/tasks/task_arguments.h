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

class TaskArguments {
 public:
  /// --threads, --tasks, --parts. `parts_help`: of --parts; empty: the default text.
  void add_to(Command& command, const std::string& parts_help = "");

  /// The folder of finished tasks where --parts is not given: beside a file that is written.
  void default_parts(const std::string& folder);

  /// Runs a command's work, on every rank alike, which ends with rank 0 alone writing. Ranks other
  /// than 0 say nothing, but for how they died. What a rank throws ends all of them; rank 0 throws
  /// it. Returns what `work` does on rank 0, elsewhere 0.
  int in_world(const std::function<int(World&)>& work);

  /// @throws InputError for a --tasks that is none, or without a folder.
  RunSettings settings(std::function<bool()> stop = {}) const;
  /// Runs the list. With a folder, the command line is written into it first, for `merge`.
  Results run(World& world, const TaskList& list, std::function<bool()> stop = {},
              bool everywhere = false) const;

  /// One share of several was to be run: no result is written.
  bool is_share() const { return !share_.empty(); }
  bool joins() const { return join_; }
  const std::string& parts() const { return parts_; }
  int threads() const { return threads_; }

  /// Where results are not complete: says how far they are and what to do. Returns the exit code.
  int explain_incomplete(const Results& results, Report& report) const;

 private:
  void keep_command_line() const;

  int threads_ = 0;
  std::string share_, parts_;
  bool join_ = false;
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
