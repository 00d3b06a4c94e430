// Gauss-Seidel sweeps over the constraints of an island.
//
// One constraint after the other takes the impulse that its widened law (mixed_system.h) gives at
// the present velocities, with sigma from the constraint's own response A_c = J_c inv(M) J_c'. A
// sweep costs little and finds, from almost anywhere, roughly which contacts carry and slide; the
// remaining error converges slowly and is left to Newton's method (M. Silcowitz, S. Niebe, K.
// Erleben, "Projected Gauss-Seidel subspace minimization method for interactive rigid body
// dynamics", 2010, divide the work in this way).
#pragma once

#include <vector>

#include "counterpoint/contact/solve/mixed_system.h"
#include "counterpoint/contact/solve/responses.h"
#include "counterpoint/contact/solve/wide_laws.h"

namespace counterpoint::contact {

class Sweeps {
 public:
  /// Reserves the memory that an island needs.
  void reserve(const IslandSystem& system);
  /// Takes the island with its present laws.
  void begin(const IslandSystem& system);
  /// Sets the velocity to that of the impulses, w = w* + inv(M) J'f. Must be called before run().
  void start(MixedSystem::Point& point);
  /// Runs `count` sweeps, each forward and backward, with `smoothing` [J] added to every law.
  /// Changes of an impulse below `negligible` [sqrt J] are skipped.
  void run(int count, double smoothing, double negligible, MixedSystem::Point& point);

 private:
  bool visit(int constraint, double smoothing, double negligible, MixedSystem::Point& point);
  void find_widths(int constraint);

  const IslandSystem* system_ = nullptr;
  bool ready_ = false, possible_ = false;
  Responses responses_;
  std::vector<WideLaw> laws_;
  std::vector<double> f_;
};

}  // namespace counterpoint::contact
