// How exactly the inverse gives back what was applied.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/engine/simulator.h"
#include "support/random_model.h"

namespace counterpoint::test {

/// Largest error of the applied force over the largest force, with random forces held for ten
/// steps.
template <typename Look>
double recover(Simulator& sim, int steps, double force, Random& random, Look after_step) {
  double error = 0.0, scale = 0.0;
  sim.settings().tolerance = 1e-12;  // so that the inverse's own error is seen, not the solver's
  for (int i = 0; i < steps; ++i) {
    if (i % 10 == 0)
      sim.input().applied_force = random_vector(sim.model().nv(), random.bits(), force);
    const State before = sim.state();
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << "step " << i << ": " << contact::status_name(report.status);
    if (!report.succeeded()) break;
    find_taut_links(sim.state(), sim.input().taut_links);
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    sim.input().taut_links.clear();
    error =
        std::max(error, (inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff());
    scale = std::max(scale, inverse.force_scale);
    after_step();
  }
  return error / scale;
}
inline double recover(Simulator& sim, int steps, double force, Random& random) {
  return recover(sim, steps, force, random, [] {});
}

/// Rounding of w+ makes |J| |w| 1e-16 of y, over r h a force: 5e-10 of the forces of gravity for a
/// chain of hinges at 4 rad/s, 2 ms and r = 1e-4 alpha.
inline constexpr double kRecovered = 1e-9;

}  // namespace counterpoint::test
