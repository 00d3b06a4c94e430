// Clocks to measure durations with; no result depends on them.
#pragma once

#include <chrono>
#include <ctime>

namespace counterpoint {

/// Processor time of the calling thread [s], which depends little on other load of the machine.
inline double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Wall time since an arbitrary moment [s].
inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace counterpoint
