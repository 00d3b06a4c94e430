#pragma once

#include <chrono>

namespace counterpoint::optimization {

/// Time [s] since a fixed moment.
inline double seconds() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

}  // namespace counterpoint::optimization
