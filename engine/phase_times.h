// Where the time of forward steps goes. A step reads the clock only where someone asks.
#pragma once

#include <chrono>

namespace counterpoint {

/// Added up over steps [s].
struct PhaseTimes {
  double contacts = 0.0;     ///< poses, contacts and the other constraints that may act
  double dynamics = 0.0;     ///< forces that need no solve, and the velocity that they lead to
  double constraints = 0.0;  ///< the contact problem: assembling and solving it
  double overlaps = 0.0;     ///< the recovery of overlaps
  double step = 0.0;         ///< the whole step; what the others leave is integration and checks
};

class Workspace;

/// Steps with this workspace add to `times` from here on, which must live as long; null: to none, and no
/// clock is read.
void measure_phases(Workspace& workspace, PhaseTimes* times);

/// Adds the time of its own life to one of them.
class PhaseTimer {
 public:
  PhaseTimer(PhaseTimes* times, double PhaseTimes::*phase) : times_(times), phase_(phase) {
    if (times_ != nullptr) start_ = Clock::now();
  }
  ~PhaseTimer() {
    if (times_ != nullptr) times_->*phase_ += std::chrono::duration<double>(Clock::now() - start_).count();
  }
  PhaseTimer(const PhaseTimer&) = delete;
  PhaseTimer& operator=(const PhaseTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  PhaseTimes* times_;
  double PhaseTimes::*phase_;
  Clock::time_point start_;
};

}  // namespace counterpoint
