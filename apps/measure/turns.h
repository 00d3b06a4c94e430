// Several ways to do one computation, timed in turns so that changes in the speed of the machine
// affect all of them alike.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace counterpoint::apps {

/// One of them: `run(count)` repeats it `count` times.
struct Contender {
  std::string name;
  std::function<void(int)> run;
};

/// Median seconds of each contender, and the median of its ratio to the first contender within a
/// round.
struct Timing {
  std::vector<double> seconds, ratio;
};

/// Returns the medians over `rounds`, each with the seconds of every contender.
Timing medians(const std::vector<std::vector<double>>& rounds);

/// In every round each contender runs once for about `slice` seconds, after an initial round that
/// is not counted. Returns times of one evaluation.
Timing take_turns(const std::vector<Contender>& contenders, int rounds, double slice);

}  // namespace counterpoint::apps
