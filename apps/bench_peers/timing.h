// Several ways to do one thing, timed in turn so that changes in the
// speed of the machine affect all of them alike.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "measure/thread_clock.h"

namespace counterpoint::apps {

/// One of them: `run(count)` does it so many times.
struct Contender {
  std::string name;
  std::function<void(int)> run;
};

/// Median seconds of one time, by contender, and median ratio to the first contender's.
struct Timing {
  std::vector<double> seconds, ratio;
};

/// In every round each contender runs once for about `slice` seconds, after a round that is not
/// counted; ratios are taken within a round.
Timing take_turns(const std::vector<Contender>& contenders, int rounds, double slice);

}  // namespace counterpoint::apps
