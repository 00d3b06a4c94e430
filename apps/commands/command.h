// The subcommands of `counterpoint`, in one file each. To add one, write add_<name> and list it
// here and in main.cc.
#pragma once

#include "command_line/command_line.h"

namespace counterpoint::apps {

/// Exit codes. kBadInput is for errors that the user can correct: an InputError or a wrong command
/// line.
enum ExitCode { kSuccess = 0, kFailed = 1, kBadInput = 2 };

void add_simulate(CommandLine& line);
void add_rollout(CommandLine& line);
void add_sweep(CommandLine& line);
void add_merge(CommandLine& line);
void add_inverse(CommandLine& line);
void add_derivatives(CommandLine& line);
void add_compare(CommandLine& line);
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
void add_list(CommandLine& line);
void add_generate(CommandLine& line);

}  // namespace counterpoint::apps
