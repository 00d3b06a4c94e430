// How a Newton iteration of an optimization went.
#pragma once

namespace counterpoint::optimization {

/// The largest of a quantity over a motion, and its mean over the frames.
struct Spread {
  double max = 0.0, mean = 0.0;
};

/// How one iteration went.
struct Iteration {
  bool accepted = false;
  double cost = 0.0, decrease = 0.0;
  double step = 0.0;  ///< largest change of a coordinate [m, rad]
  double damping = 0.0;
  int trials = 0;
  double linearize_seconds = 0.0, factor_seconds = 0.0, trial_seconds = 0.0;
};

}  // namespace counterpoint::optimization
