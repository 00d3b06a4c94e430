// Figures observed during a run in addition to the step reports: energy beyond the work of the
// inputs and of the overlap correction, depth of bodies below the ground.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "report/report.h"
#include "report/total_energy.h"

namespace counterpoint::apps {

class RunWatch {
 public:
  /// Starts at the simulator's current state; evaluates energies at every `every`-th step.
  explicit RunWatch(Simulator& simulator, long every = 1);

  /// Call after every step. `h`: length of the step [s]; `state`: its end.
  void after_step(double h, const State& state);
  /// Writes the figures (docs/reference/json-reports.md).
  void fill(Json& out) const;
  /// Describes unexplained energy and the closure that opened most; empty if neither exceeds its
  /// threshold.
  std::string warning() const;

 private:
  double energy(const State& state);
  /// Energy at the end of a step to `state` [J]; leaves dynamics_ at its poses.
  double energy_left(const State& state);
  /// Gravitational and spring energy [J]; leaves dynamics_ at q (nq).
  double potential(const VectorX& q);
  void add_overlap_work(double h, const State& state);
  /// Rows of M(q) v starting at `first`: linear momentum of a floating tree [kg m/s].
  Vector3 momentum_rows(const VectorX& q, const VectorX& v, int first);
  /// Kinetic energy of the centres of mass at `state` minus that at q_moved_ [J].
  double center_energy(const State& state);
  double below_ground() const;
  bool knows_work() const;
  void look_at_closures(const VectorX& q);

  Simulator& simulator_;  ///< read only; non-const because of its input()
  Dynamics dynamics_;
  VectorX q_, v_, q_moved_;
  SurfaceSprings springs_;
  VectorX momentum_, rest_;
  double start_ = 0.0, work_ = 0.0, path_work_ = 0.0, overlap_work_ = 0.0;  ///< [J]
  double gain_ = 0.0, excess_ = 0.0, highest_ = 0.0;                        ///< [J]
  double below_ = 0.0;                                                      ///< deepest so far [m]
  double fastest_ = 0.0;                           ///< highest kinetic energy [J]
  double lowest_ = 0.0, highest_potential_ = 0.0;  ///< potential energy [J]
  long every_, steps_ = 0;
  // Closures: opening at the start, and largest increase since [m or rad].
  std::vector<double> gap_at_start_;
  double opened_ = 0.0;
  int opened_most_ = -1;
};

}  // namespace counterpoint::apps
