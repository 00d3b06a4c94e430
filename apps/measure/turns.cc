#include "turns.h"

#include <algorithm>

#include "counterpoint/engine/clocks.h"
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

Timing medians(const std::vector<std::vector<double>>& rounds) {
  Timing timing;
  for (std::size_t i = 0; i < rounds.front().size(); ++i) {
    std::vector<double> seconds, ratio;
    for (const std::vector<double>& round : rounds) {
      seconds.push_back(round[i]);
      ratio.push_back(round[i] / round[0]);
    }
    timing.seconds.push_back(median(seconds));
    timing.ratio.push_back(median(ratio));
  }
  return timing;
}

Timing take_turns(const std::vector<Contender>& contenders, int rounds, double slice) {
  std::vector<int> counts;
  for (const Contender& contender : contenders) counts.push_back(times_in(contender, slice));
  std::vector<std::vector<double>> seconds(static_cast<std::size_t>(rounds));
  for (std::vector<double>& round : seconds) {
    for (std::size_t i = 0; i < contenders.size(); ++i)
      round.push_back(seconds_each(contenders[i], counts[i]));
  }
  return medians(seconds);
}

}  // namespace counterpoint::apps
