// counterpoint: simulates a scene, recovers the forces behind a motion, compares with recordings.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "command.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::apps {
namespace {

constexpr auto kSubcommands = {
    add_simulate,    add_live,       add_inverse,         add_view,     add_inspect,  add_export,
    add_convert,     add_optimize,   add_retarget,        add_control,  add_rollout,  add_sweep,
    add_merge,       add_compare,    add_explain,         add_identify, add_excite,   add_accuracy,
    add_derivatives, add_hard_cases, add_contact_problem, add_list,     add_generate, add_version};

int run(int argc, char** argv) {
  CommandLine line(
      "Rigid-body physics with convex, smooth, invertible contact.",
      "Exit codes: 0 done, 1 the computation failed, 2 bad input.\n"
      "Example:\n  counterpoint simulate humanoid_drop --output fall.csv --view fall.html",
      help_topics());
  for (const auto add : kSubcommands) add(line);
  return line.run(argc, argv);
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
    fmt::print(stderr, "error: {}\n", error.what());
    return kFailed;
  }
}
