// Sweeps of Gauss and Seidel over the constraints of an island.
//
// One constraint after the other takes the impulse that its widened law (mixed_system.h) gives at
// the velocities of the moment, with sigma what the constraint feels of itself, A_c = J_c inv(M)
// J_c'. A sweep costs little and finds, from almost anywhere, roughly which contacts carry and
// slide; what is left converges slowly and is for Newton's method (M. Silcowitz, S. Niebe, K.
// Erleben, "Projected Gauss-Seidel subspace minimization method for interactive rigid body
// dynamics", 2010, divide the work like this).
#pragma once

#include <vector>

#include "counterpoint/contact/solve/mixed_system.h"
#include "counterpoint/contact/solve/responses.h"
#include "counterpoint/contact/solve/wide_law.h"

namespace counterpoint::contact {

class Sweeps {
 public:
  /// Takes the memory that an island needs.
  void reserve(const IslandSystem& system);
  /// Takes the island with its laws as they are now.
  void begin(const IslandSystem& system);
  /// The velocity becomes that of the impulses: w = w* + inv(M) J'f. To be called before run().
  void start(MixedSystem::Point& point);
  /// `count` sweeps, there and back, with laws of so much more smoothing [J]. Changes of an impulse
  /// below `negligible` [sqrt J] are not made.
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
