#include <fmt/format.h>

#include <Eigen/Core>

#include "command.h"
#include "peers/mujoco.h"
#include "tasks/world.h"
#include "view/program.h"
#include "view/replay.h"

namespace counterpoint::apps {
namespace {

/// Lists the instruction sets of this processor, among those that matter for speed here.
std::string processor() {
#if defined(__x86_64__) && defined(__GNUC__)
  std::string found = "x86-64";
  const auto add = [&](bool has, const char* name) {
    if (has) found += fmt::format(" {}", name);
  };
  add(__builtin_cpu_supports("sse4.2"), "sse4.2");
  add(__builtin_cpu_supports("avx"), "avx");
  add(__builtin_cpu_supports("avx2"), "avx2");
  add(__builtin_cpu_supports("fma"), "fma");
  add(__builtin_cpu_supports("avx512f"), "avx512f");
  return found;
#else
  return "not asked on this architecture";
#endif
}

/// Fills the report with how the program was built and which optional parts it has; null: left out.
void fill(Report& report) {
  const auto part = [](bool has, const std::string& version) {
    return has ? Json(version) : Json(nullptr);
  };
  const std::string mpi = tasks::mpi_version(), mujoco = peers::mujoco_version();
  report["format"] = COUNTERPOINT_FORMAT;
  report["compiler"] = COUNTERPOINT_COMPILER;
  report["build"] = COUNTERPOINT_BUILD;
  report["eigen"] = fmt::format("{}.{}.{} with {}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
                                EIGEN_MINOR_VERSION, Eigen::SimdInstructionSetsInUse());
  report["processor"] = processor();
  report["replay_pages"] = view::can_make_pages();
  report["hdf5"] = COUNTERPOINT_HAS_HDF5 != 0;
  report["sdf"] = COUNTERPOINT_HAS_SDF != 0;
  report["mpi"] = part(!mpi.empty(), mpi);
  report["mujoco"] = part(!mujoco.empty(), mujoco);
}

int version(Report& report) {
  report.begin("version", "");
  fill(report);
  report.print_entries(
      "counterpoint {version}\n"
      "build:        {build}\n"
      "compiled by:  {compiler}, with Eigen {eigen}\n"
      "runs on:      {processor}\n");
  const auto print = [&](const char* name, const Json& has, const std::string& why_not) {
    const std::string value = has.is_string() ? has.get<std::string>() : "yes";
    const bool found = has.is_string() || (has.is_boolean() && has.get<bool>());
    report.print("{:<13} {}\n", name, found ? value : fmt::format("no ({})", why_not));
  };
  print("replay pages:", report["replay_pages"], view::program_missing());
  print("HDF5:", report["hdf5"], "built without libhdf5-dev");
  print("SDF:", report["sdf"], "built without libsdformat-dev");
  print("MPI:", report["mpi"], "built without libopenmpi-dev");
  print("MuJoCo:", report["mujoco"], "built without libmujoco-dev");
  report.write();
  return kSuccess;
}

}  // namespace

void add_version(CommandLine& line) {
  auto [command, report] = line.add<Report>(
      "version", "Print the version, how it was built and which optional parts it has",
      "Example:\n  counterpoint --version --json -", version);
  report.add_to(command);
}

}  // namespace counterpoint::apps
