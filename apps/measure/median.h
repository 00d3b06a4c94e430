// The median of a few numbers.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

namespace counterpoint::apps {

/// Of an even number the mean of the middle two; NaN of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

}  // namespace counterpoint::apps
