// Several ways to do one computation, timed in turns so that changes in the speed of the machine
// affect all of them alike.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "measure/thread_clock.h"

namespace counterpoint::apps {

/// One of them: `run(count)` repeats it `count` times.
struct Contender {
  std::string name;
  std::function<void(int)> run;
};

/// Median seconds per evaluation of each contender, and the median of its ratio to the first
/// contender.
struct Timing {
  std::vector<double> seconds, ratio;
};

/// In every round each contender runs once for about `slice` seconds, after an initial round that
/// is not counted; ratios are taken within a round.
Timing take_turns(const std::vector<Contender>& contenders, int rounds, double slice);

}  // namespace counterpoint::apps
