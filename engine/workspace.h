// The scratch memory of steps, and the time that steps take. A step reads the clock only if
// somebody measures it.
#pragma once

#include <chrono>
#include <memory>
#include <span>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Times of the phases of steps, summed over steps [s].
struct PhaseTimes {
  double contacts = 0.0;     ///< kinematics, contact search and other constraints
  double dynamics = 0.0;     ///< forces beside constraints, and the free velocity
  double constraints = 0.0;  ///< assembling and solving the contact problem
  double overlaps = 0.0;     ///< correction of overlaps
  double step = 0.0;         ///< the whole step; the rest is integration and checks
};

class Workspace;

/// Lets later steps with this workspace add to `times`, which must live as long as they run. Null:
/// steps read no clock.
void measure_phases(Workspace& workspace, PhaseTimes* times);

/// Adds the time of its own life to one of the phases.
class PhaseTimer {
 public:
  PhaseTimer(PhaseTimes* times, double PhaseTimes::*phase) : times_(times), phase_(phase) {
    if (times_ != nullptr) start_ = Clock::now();
  }
  ~PhaseTimer() {
    if (times_ != nullptr)
      times_->*phase_ += std::chrono::duration<double>(Clock::now() - start_).count();
  }
  PhaseTimer(const PhaseTimer&) = delete;
  PhaseTimer& operator=(const PhaseTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  PhaseTimes* times_;
  double PhaseTimes::*phase_;
  Clock::time_point start_;
};

/// Scratch memory of one thread for one model: created once, grown while sizes are new, then
/// reused. No result depends on its contents.
class Workspace {
 public:
  explicit Workspace(const Model& model);
  ~Workspace();
  Workspace(Workspace&&) noexcept;
  Workspace& operator=(Workspace&&) noexcept;

  /// Returns how often the code of each effect has run, in steps and inverses with this workspace.
  const EffectCounts& effect_counts() const;
  /// Returns the trees that no other body touched in the last step or inverse. Their centre of mass
  /// moves by outer forces alone, so the translation of their base differs from q (+) h v+
  /// (docs/explanation/integrators.md, Momentum).
  std::span<const int> free_trees() const;

  /// Lets this number of threads share the trees and islands of each forward step, to the same
  /// bits; 1 at first. It pays from some ten islands on; explicit integrators do not share. @throws
  /// InputError unless it is positive.
  void set_threads(int count);

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint
