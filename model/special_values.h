#pragma once

#include <limits>

namespace counterpoint {

/// What is not limited: a position, a force, a distance.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// What is not known.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace counterpoint
