// A box that tumbles on a surface with a stiffness per area, from face to edge to corner.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::area_tumbling_test {
namespace {

/// Kinetic and potential energy, without springs [J].
double energy(const Simulator& sim) {
  Dynamics dynamics(sim.model());
  dynamics.set_state(sim.state().q, sim.state().v);
  return dynamics.kinetic_energy() + dynamics.potential_energy();
}

/// A box that is thrown onto its edges and corners. `dissipation`: of its surface [s/m].
Scene tumbling(double h, double dissipation, const std::string& more = "", double friction = 0.5) {
  const test::TempFolder folder;
  return load_scene(
      folder.write("scene.yaml", fmt::format(R"(
time_step: {}
{}
ground: {{friction: {}}}
models:
  - {{name: box, box: [0.1, 0.15, 0.2], mass: 2, position: [0, 0, 0.3], rpy: [0.2, 0.4, 0.1],
     stiffness_per_area: 3.0e+5, dissipation: {}, friction: {},
     velocity: {{linear: [0.5, -0.2, -1], angular: [2, 3, 1]}}}}
)",
                                             h, more, friction, dissipation, friction)));
}

// Patches grow, shrink and change from face to edge to corner while a box tumbles. Their forces are
// those of a potential: without a damper no step adds energy.
TEST(AreaStiffness, ChangingPatchesGainNoEnergy) {
  constexpr double kRoundOff = 1e-9;
  for (const char* integrator : {"semi_implicit_euler", "implicit_midpoint"}) {
    for (const double h : {0.0005, 0.002, 0.01}) {
      for (const double friction : {0.0, 0.5}) {
        Simulator sim(tumbling(h, 0.0, fmt::format("integrator: {}", integrator), friction));
        const double start = energy(sim);
        double most = 0.0;
        while (sim.state().time < 0.6) {
          ASSERT_TRUE(sim.step().succeeded());
          most = std::max(most, energy(sim) / start);
        }
        EXPECT_LE(most, 1.0 + kRoundOff) << integrator << h << friction;
      }
    }
  }
}

TEST(AreaStiffness, TheInverseRecoversTheForces) {
  for (const char* friction : {"convex", "coulomb"}) {
    Simulator sim(tumbling(0.002, 0.2, fmt::format("contact: {{friction_model: {}}}", friction)));
    test::Random random(5);
    EXPECT_LT(test::recover(sim, 400, 8.0, random), test::kRecovered) << friction;
  }
}

// The share of a point changes with the poses, for which there is no closed form: the derivatives
// are differences of the whole inverse, and say so.
TEST(AreaStiffness, DerivativesAreThoseOfDifferences) {
  Scene scene = tumbling(0.002, 0.2);
  Simulator sim(scene);
  do ASSERT_TRUE(sim.step().succeeded());
  while (sim.last_forces().contacts.empty() || sim.last_forces().contacts[0].force.norm() < 1.0);
  const State& s = sim.state();
  const VectorX next = s.v;
  EXPECT_FALSE(test::expect_exact(scene, {s.q, s.v, next, {}}, "box", true, 1e-7));
}

}  // namespace
}  // namespace counterpoint::area_tumbling_test
