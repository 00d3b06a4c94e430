#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <thread>

#include "counterpoint/engine/batch.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr int kMostProcessors = 1 << 16;

/// Parses "max 100000" or "150000 100000": quota and period [us].
double version_2(const fs::path& group) {
  std::ifstream stream(group / "cpu.max");
  double quota = 0.0, period = 0.0;
  return stream >> quota >> period && quota > 0.0 && period > 0.0 ? quota / period : kNoLimit;
}

double version_1(const fs::path& group) {
  std::ifstream quota_stream(group / "cpu.cfs_quota_us"),
      period_stream(group / "cpu.cfs_period_us");
  double quota = -1.0, period = 0.0;  // [us]; a quota of -1: no limit
  return quota_stream >> quota && period_stream >> period && quota > 0.0 && period > 0.0
             ? quota / period
             : kNoLimit;
}

/// Returns the smallest limit of a group and its ancestors.
double least(const fs::path& root, fs::path group, double (*limit)(const fs::path&)) {
  double cores = limit(root);
  for (group = group.relative_path(); !group.empty(); group = group.parent_path())
    cores = std::min(cores, limit(root / group));
  return cores;
}

}  // namespace

std::vector<int> affinity_cores() {
  std::vector<int> cores;
  // The kernel rejects a mask shorter than its own.
  for (int size = CPU_SETSIZE; cores.empty() && size <= kMostProcessors; size *= 2) {
    cpu_set_t* set = CPU_ALLOC(size);
    const size_t bytes = CPU_ALLOC_SIZE(size);
    if (sched_getaffinity(0, bytes, set) == 0)
      for (int i = 0; i < size; ++i)
        if (CPU_ISSET_S(i, bytes, set)) cores.push_back(i);
    CPU_FREE(set);
  }
  const int all = static_cast<int>(std::thread::hardware_concurrency());
  for (int i = 0; cores.empty() && i < all; ++i) cores.push_back(i);
  if (cores.empty()) cores.push_back(0);
  return cores;
}

double cgroup_cores(const fs::path& root, const std::string& membership) {
  double cores = kNoLimit;
  std::istringstream lines(membership);
  // Lines are "0::/user.slice/job" in version 2, "4:cpu,cpuacct:/job" in version 1.
  for (std::string line; std::getline(lines, line);) {
    const size_t first = line.find(':');
    const size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    if (controllers.empty()) cores = std::min(cores, least(root, group, version_2));
    if (("," + controllers + ",").find(",cpu,") == std::string::npos) continue;
    for (const std::string& folder : {controllers, std::string("cpu")})
      cores = std::min(cores, least(root / folder, group, version_1));
  }
  return cores;
}

double cgroup_cores() {
  std::ifstream stream("/proc/self/cgroup");
  return cgroup_cores("/sys/fs/cgroup", {std::istreambuf_iterator<char>(stream), {}});
}

int available_cores() {
  const double cores =
      std::min(static_cast<double>(affinity_cores().size()), std::floor(cgroup_cores()));
  return std::max(1, static_cast<int>(cores));
}

int num_threads_of(int wanted) { return wanted > 0 ? wanted : available_cores(); }

}  // namespace counterpoint
