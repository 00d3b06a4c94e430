// The subcommands of `counterpoint`, in one file each. To add one, write add_<name> and list it
// here and in main.cc.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <string>
#include <vector>

#include "command_line/command_line.h"
#include "report/report.h"
#include "tasks/task_arguments.h"

namespace counterpoint::apps {

/// Exit codes. kBadInput is for errors that the user can correct: an InputError or a wrong command
/// line.
enum ExitCode { kSuccess = 0, kFailed = 1, kBadInput = 2 };

void add_simulate(CommandLine& line);
void add_live(CommandLine& line);
void add_rollout(CommandLine& line);
void add_sweep(CommandLine& line);
void add_merge(CommandLine& line);
void add_inverse(CommandLine& line);
void add_derivatives(CommandLine& line);
void add_compare(CommandLine& line);
void add_excite(CommandLine& line);
void add_explain(CommandLine& line);
void add_identify(CommandLine& line);
void add_inspect(CommandLine& line);
void add_export(CommandLine& line);
void add_convert(CommandLine& line);
void add_contact_problem(CommandLine& line);
void add_hard_cases(CommandLine& line);
void add_accuracy(CommandLine& line);
void add_view(CommandLine& line);
void add_optimize(CommandLine& line);
void add_retarget(CommandLine& line);
void add_control(CommandLine& line);
void add_list(CommandLine& line);
void add_generate(CommandLine& line);
void add_version(CommandLine& line);

/// Texts of `counterpoint help TOPIC`.
std::vector<Topic> help_topics();

/// Makes the function of a command that runs on every rank of MPI (tasks::TaskArguments::in_world).
template <typename Arguments>
std::function<int(Arguments&)> on_every_rank(int (*run)(Arguments&, tasks::World&)) {
  return [run](Arguments& arguments) {
    return arguments.tasks.in_world(arguments.report,
                                    [&](tasks::World& world) { return run(arguments, world); });
  };
}

/// Reports on standard error that Ctrl-C ended the command and how far it came: " after 3 of 5
/// steps". Returns the exit code.
template <typename... Values>
int end_stopped(fmt::format_string<const Values&...> rest, const Values&... values) {
  fmt::print(stderr, "error: stopped by Ctrl-C or SIGTERM{}\n", fmt::format(rest, values...));
  return kFailed;
}

/// The same, in the report too: "3 of 5 recordings were compared". `files`: "; the page is in ...".
inline int end_stopped(const std::string& so_far, const std::string& files, Report& report) {
  report["status"] = "stopped";
  report["message"] = "stopped by Ctrl-C or SIGTERM: " + so_far;
  return end_stopped(": {}{}", so_far, files);
}

}  // namespace counterpoint::apps
