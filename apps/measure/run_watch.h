// Figures observed over a run beside the steps themselves: energy beyond the work of the inputs,
// depth of bodies below the ground.
#pragma once

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/simulator.h"
#include "report/report.h"

namespace counterpoint::apps {

class RunWatch {
 public:
  /// From the simulator's state as it is.
  explicit RunWatch(Simulator& simulator);

  /// After every step from the last state seen. `h` [s]: its length.
  void after_step(double h);
  /// docs/reference/json-reports.md.
  void fill(Json& out) const;

 private:
  double energy();
  double below_ground() const;

  Simulator& simulator_;  ///< read only; its input() is there for writers alone
  Data data_;
  VectorX v_;
  double start_ = 0.0, work_ = 0.0, gain_ = 0.0;  ///< [J]
};

}  // namespace counterpoint::apps
