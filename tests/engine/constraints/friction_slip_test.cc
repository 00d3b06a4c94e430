// While a part of an island slides, its sticking parts creep by the share h / slip_time of that.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "counterpoint/engine/simulator.h"
#include "support/temp_folder.h"

namespace counterpoint::friction_slip_test {
namespace {

constexpr double kStep = 0.002, kSlider = 1.0;  // [s], speed on the plank [m/s]
constexpr double kShare = 0.5;                  // push on a plank over its friction bound

/// Two planks of 2 kg, 5 m apart, pushed; a frictionless slider of 1 kg on the first one.
Scene two_planks(double slip_time) {
  const test::TempFolder folder;
  Scene scene = load_scene(folder.write("planks.yaml", R"(
time_step: 0.002
ground: {friction: 0.5}
models:
  - {name: plank, box: [1, 0.2, 0.05], mass: 2, friction: 0.5, position: [0, 0, 0.05]}
  - {name: alone, box: [1, 0.2, 0.05], mass: 2, friction: 0.5, position: [0, 5, 0.05]}
  - {name: slider, box: [0.05, 0.05, 0.05], mass: 1, friction: 0, position: [-0.2, 0, 0.15],
     velocity: {linear: [1, 0, 0]}}
)"));
  scene.options.contact.slip_time = slip_time;
  return scene;
}

struct Creep {
  double plank = 0.0, alone = 0.0;  ///< mean speed [m/s]
  double unexplained = 0.0;         ///< largest error of the inverse, over the weight
};

Creep push(double slip_time) {
  Simulator sim(two_planks(slip_time));
  VectorX& force = sim.input().applied_force;
  force.setZero(sim.model().nv());
  force[0] = kShare * 0.5 * 3.0 * kStandardGravity;
  force[6] = kShare * 0.5 * 2.0 * kStandardGravity;
  Creep out;
  constexpr int kSteps = 100, kSettling = 5;  // 0.2 s; the slider stays on the plank
  for (int k = 0; k < kSteps; ++k) {
    const State before = sim.state();
    EXPECT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    out.unexplained = std::max(out.unexplained,
                               (inverse.applied_force - force).norm() / (3.0 * kStandardGravity));
    if (k < kSettling) continue;
    out.plank += sim.state().v[0] / (kSteps - kSettling);
    out.alone += sim.state().v[6] / (kSteps - kSettling);
  }
  return out;
}

// Every corner slips equally, so that the sum of n y / v_slip over them is the force: y = sigma
// v_slip, however the load is distributed.
TEST(FrictionSlip, IsTheShareOfTheConeWhateverTheLoads) {
  for (const double slip_time : {2.0, 0.5}) {
    const Creep creep = push(slip_time);
    // The compliance adds eps g h sigma, about 1e-8 m/s; the slider moves relative to the plank at
    // its speed less the plank's own.
    const double expected = kShare * kSlider * kStep / slip_time;
    EXPECT_NEAR(creep.plank, expected, 2.0 * expected * kStep / slip_time + 1e-7) << slip_time;
    EXPECT_LT(std::abs(creep.alone), 1e-7);  // another island
    EXPECT_LT(creep.unexplained, 1e-8);      // the inverse's floor at 1 m/s is 5e-9
  }
}

TEST(FrictionSlip, IsNoneWhereSlipTimeIsInfinite) {
  const Creep creep = push(std::numeric_limits<double>::infinity());
  EXPECT_LT(std::abs(creep.plank), 1e-7);
}

// The first step of a single body at rest on the ground: nothing moves, so nothing slips.
TEST(FrictionSlip, FadesWithTheMotion) {
  Scene scene = two_planks(2.0);
  Simulator sim(std::move(scene));
  sim.input().applied_force.setZero(sim.model().nv());
  sim.input().applied_force[6] = kShare * 0.5 * 2.0 * kStandardGravity;
  sim.step();
  // sigma eps g h alpha m, with the normal's share of the compliance: below 1e-7 m/s.
  EXPECT_LT(std::abs(sim.state().v[6]), 1e-7);
}

}  // namespace
}  // namespace counterpoint::friction_slip_test
