// counterpoint: simulate a scene, recover the forces behind a motion, compare with recordings.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "command.h"
#include "counterpoint/model/types.h"

namespace counterpoint::apps {
namespace {

constexpr auto kSubcommands = {add_simulate,        add_rollout,    add_inverse,  add_derivatives,
                               add_optimize,        add_compare,    add_identify, add_inspect,
                               add_contact_problem, add_hard_cases, add_accuracy, add_view};

int run(int argc, char** argv) {
  CLI::App app{"Rigid-body physics with convex, smooth, invertible contact."};
  app.name("counterpoint");
  app.set_version_flag("--version", COUNTERPOINT_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 the computation failed, 2 bad input.\n"
      "Example:\n  counterpoint simulate data/scenes/humanoid_drop.yaml --output fall.csv");
  Action action;
  for (const auto add : kSubcommands) add(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kSuccess : kBadInput;
  }
  return action();
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  using namespace counterpoint::apps;
  try {
    return run(argc, argv);
  } catch (const counterpoint::InputError& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "failed: {}\n", error.what());
    return kFailed;
  }
}
