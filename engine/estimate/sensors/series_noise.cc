#include "counterpoint/engine/estimate/sensors/series_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace counterpoint::estimation {
namespace {

/// Quantile of absolute values used for the estimate, and its value for a standard normal
/// distribution. The median would be zero if an encoder repeats values.
constexpr double kShare = 0.75, kAtShare = 1.1503;

}  // namespace

double series_noise(VectorX steps, int order) {
  double out = 0.0;
  double growth = 2.0;  // variance growth of white noise: (2 n)! / n!^2 for differences of order n
  for (int n = 2; n <= order && steps.size() > 1; ++n) {
    steps = (steps.tail(steps.size() - 1) - steps.head(steps.size() - 1)).eval();
    growth *= 4.0 - 2.0 / n;
    if (n < 3) continue;
    std::vector<double> size;
    for (const double d : steps)
      if (std::isfinite(d)) size.push_back(std::abs(d));
    if (size.empty()) break;
    const auto at = size.begin() + static_cast<std::ptrdiff_t>(kShare * (size.size() - 1));
    std::nth_element(size.begin(), at, size.end());
    const double noise = *at / kAtShare / std::sqrt(growth);
    out = n == 3 ? noise : std::min(out, noise);
  }
  return out;
}

}  // namespace counterpoint::estimation
