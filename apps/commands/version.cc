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

}  // namespace

std::string version_text() {
  const std::string mpi = tasks::mpi_version();
  const std::string mujoco = peers::mujoco_version();
  return fmt::format(
      "counterpoint {}\n"
      "build:        {}\n"
      "compiled for: Eigen {}.{}.{} with {}\n"
      "runs on:      {}\n"
      "replay pages: {}\n"
      "MPI:          {}\n"
      "MuJoCo:       {}\n",
      COUNTERPOINT_VERSION, COUNTERPOINT_BUILD, EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
      EIGEN_MINOR_VERSION, Eigen::SimdInstructionSetsInUse(), processor(),
      view::can_make_pages() ? "yes" : fmt::format("no ({})", view::program_missing()),
      mpi.empty() ? "no (built without libopenmpi-dev)" : mpi,
      mujoco.empty() ? "no (built without libmujoco-dev)" : mujoco);
}

}  // namespace counterpoint::apps
