// Figures observed over a run beside the steps themselves: energy beyond the work of the inputs
// and of the correction of overlaps, depth of bodies below the ground.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "report/report.h"

namespace counterpoint::apps {

class RunWatch {
 public:
  /// From the simulator's state as it is; looks at the states of every so many steps.
  explicit RunWatch(Simulator& simulator, long every = 1);

  /// After every step from the last state seen. `h` [s]: its length; `state`: where it led.
  void after_step(double h, const State& state);
  /// docs/reference/json-reports.md.
  void fill(Json& out) const;
  /// Energy that came from nowhere, and the closure that came open most, in words; empty if there
  /// is nothing to say.
  std::string warning() const;

 private:
  double energy(const State& state);
  /// By a step to `state`, [J]; leaves dynamics_ at its poses.
  double energy_left(const State& state);
  /// Of weights and springs [J]; leaves dynamics_ at q (nq).
  double potential(const VectorX& q);
  void add_overlap_work(double h, const State& state);
  /// Rows of M(q) v from `first` on: the linear momentum of a tree that floats [kg m/s].
  Vector3 momentum_rows(const VectorX& q, const VectorX& v, int first);
  /// What the kinetic energy of centres of mass is beyond that at q_moved_ [J].
  double center_energy(const State& state);
  double below_ground() const;
  bool knows_work() const;
  void look_at_closures(const VectorX& q);

  Simulator& simulator_;  ///< read only; its input() is there for writers alone
  Dynamics dynamics_;
  VectorX q_, v_, q_moved_, momentum_, rest_;
  double start_ = 0.0, work_ = 0.0, path_work_ = 0.0, overlap_work_ = 0.0;  ///< [J]
  double gain_ = 0.0, excess_ = 0.0, highest_ = 0.0;                        ///< [J]
  double below_ = 0.0;                                                      ///< deepest so far [m]
  double fastest_ = 0.0;                           ///< the highest kinetic energy [J]
  double lowest_ = 0.0, highest_potential_ = 0.0;  ///< potential energy [J]
  long every_, steps_ = 0;
  // Closures: how far open at the start, and since [m or rad].
  std::vector<double> gap_at_start_;
  double opened_ = 0.0;
  int opened_most_ = -1;
};

}  // namespace counterpoint::apps
