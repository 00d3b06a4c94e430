// Constraints that nothing can meet: closures and mimic joints that stay open. Each step of such a
// one is a valid solution (what holds the bodies apart yields as much as compliance lets it), so
// only a run shows it. A closure that is far open is to close at contact.max_recovery_speed;
// one that has closed by less than a tenth of that over closing_time, which is long enough to
// leave a singular pose (links in one line), is named.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "counterpoint/engine/fault.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

struct Data;

/// Looks at the states of one run. Its memory is no part of the motion: a run that is resumed from
/// a state is watched anew.
class StalledClosureDetector {
 public:
  explicit StalledClosureDetector(const Model& model);
  ~StalledClosureDetector();
  StalledClosureDetector(StalledClosureDetector&&) noexcept;
  StalledClosureDetector& operator=(StalledClosureDetector&&) noexcept;

  /// The next state will not be the last one's continuation.
  void restart();
  /// After a step; looks some twenty times in closing_time. The closure or mimic joint that stays
  /// open, or no fault.
  Fault look(const Model& model, const SimulationOptions& options, const State& state);

 private:
  /// Since when and from where the error [m or rad] has not come down as it is asked to.
  struct Stall {
    double since = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: it is not far open
    double error = 0.0;
  };
  static bool stalls(const SimulationOptions& options, double time, double error, Stall& stall);

  std::vector<Stall> closures_, mimics_;
  std::unique_ptr<Data> data_;  ///< for poses, where there are closures
  double next_look_ = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: not yet set
};

}  // namespace counterpoint
