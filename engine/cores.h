// How many threads this process may keep busy.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace counterpoint {

/// The processors, by number, that the affinity of this process lets its threads run on (taskset,
/// mpirun --bind-to, Slurm); those of the machine where the system does not say.
std::vector<int> affinity_cores();

/// Processors' worth of time that control groups (containers, Slurm, systemd) grant this process;
/// infinity where there is no limit. `root`: where their files are; `membership`: the text of
/// /proc/self/cgroup. Every group from that of the process up to the root may limit it, in version
/// 2 by cpu.max, in version 1 by cpu.cfs_quota_us and cpu.cfs_period_us.
double cgroup_cores(const std::filesystem::path& root, const std::string& membership);
double cgroup_cores();  ///< of this process

/// Threads that neither wait for one another's processor nor are throttled: the processors of the
/// affinity, at most the whole ones that control groups grant; 1 at least.
int available_cores();

}  // namespace counterpoint
