#pragma once

#include <limits>

namespace counterpoint {

/// Value of an absent limit: a position, a force, a distance.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Value of an unknown number.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace counterpoint
