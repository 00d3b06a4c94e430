// The subcommands of `counterpoint`, one file each. To add one: write add_<name>, list it here and
// in main.cc.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace counterpoint::apps {

/// Exit codes. Bad input is what the user can correct: an InputError, or a wrong command line.
enum ExitCode { kSuccess = 0, kFailed = 1, kBadInput = 2 };

/// Set by the subcommand on the command line; returns the exit code.
using Action = std::function<int()>;

void add_simulate(CLI::App& app, Action& action);
void add_rollout(CLI::App& app, Action& action);
void add_inverse(CLI::App& app, Action& action);
void add_derivatives(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_identify(CLI::App& app, Action& action);
void add_inspect(CLI::App& app, Action& action);
void add_contact_problem(CLI::App& app, Action& action);
void add_hard_cases(CLI::App& app, Action& action);
void add_accuracy(CLI::App& app, Action& action);
void add_view(CLI::App& app, Action& action);
void add_optimize(CLI::App& app, Action& action);

}  // namespace counterpoint::apps
