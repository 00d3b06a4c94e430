// Counterpoint beside MuJoCo and Pinocchio: the same models, in turn, in one process.
// docs/performance.md says how to run it and what it found.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "peers/mujoco.h"
#include "peers/pinocchio.h"
#include "tables.h"

namespace counterpoint::apps {
namespace {

int run(int argc, char** argv) {
  CLI::App app("Counterpoint beside MuJoCo and Pinocchio, on the same models in turn");
  PeerOptions options;
  options.scenes = COUNTERPOINT_SOURCE_DIR "/data/scenes";
  app.add_option("--robots", options.robots, "Folder below which URDFs of robots are looked for");
  app.add_option("--rounds", options.rounds, "Medians are over so many");
  CLI11_PARSE(app, argc, argv);
  fmt::print("Pinocchio: {}\nMuJoCo: {}\n", peers::pinocchio_version(), peers::mujoco_version());
  for (const PeerRow& row : compare_algorithms(options))
    fmt::print("{:28} {:11} {:13} {:9.0f} ns  ours/this {:5.2f}  {} {:.1e} {}\n", row.scene,
               row.quantity, row.engine, 1e9 * row.seconds, row.ratio, row.quality, row.error,
               row.remark);
  return 0;
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  try {
    return counterpoint::apps::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "failed: {}\n", error.what());
    return 1;
  }
}
