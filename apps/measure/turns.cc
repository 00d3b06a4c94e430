#include "timing.h"

#include <algorithm>

#include "measure/median.h"

namespace counterpoint::apps {

namespace {

double seconds_each(const Contender& contender, int count) {
  const double start = thread_seconds();
  contender.run(count);
  return (thread_seconds() - start) / count;
}

/// Number of evaluations that take about `slice` seconds.
int times_in(const Contender& contender, double slice) {
  int count = 1;
  while (count < (1 << 24)) {
    const double each = seconds_each(contender, count);
    if (each * count > 0.25 * slice) return std::max(1, static_cast<int>(slice / each));
    count *= 4;
  }
  return count;
}

}  // namespace

Timing take_turns(const std::vector<Contender>& contenders, int rounds, double slice) {
  const std::size_t n = contenders.size();
  std::vector<int> counts;
  for (const Contender& contender : contenders) counts.push_back(times_in(contender, slice));
  std::vector<std::vector<double>> seconds(n), ratio(n);
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < n; ++i)
      seconds[i].push_back(seconds_each(contenders[i], counts[i]));
    for (std::size_t i = 0; i < n; ++i) ratio[i].push_back(seconds[i].back() / seconds[0].back());
  }
  Timing timing;
  for (std::size_t i = 0; i < n; ++i) {
    timing.seconds.push_back(median(seconds[i]));
    timing.ratio.push_back(median(ratio[i]));
  }
  return timing;
}

}  // namespace counterpoint::apps
