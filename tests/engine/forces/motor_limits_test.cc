// Effort and velocity limits of joints.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/small_scenes.h"

namespace counterpoint::motor_limits_test {
namespace {

constexpr double kRoundoff = 1e-12;

TEST(EffortLimits, ClampTheAppliedForceAndTheInverseSaysSo) {
  const double mass = 2.0, limit = 3.0;
  for (const double applied : {5.0, -5.0, 2.0, 3.0}) {
    Simulator sim(test::slider({.mass = mass, .effort_limit = limit}));
    sim.input().applied_force[0] = applied;
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    const double real = std::clamp(applied, -limit, limit);
    EXPECT_NEAR(sim.state().v[0], sim.options().time_step * real / mass, kRoundoff);
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    EXPECT_NEAR(inverse.applied_force[0], real, 1e-11);
  }
}

TEST(EffortLimits, SwitchedOffTheyDoNotClamp) {
  Scene scene = test::slider({.mass = 2.0, .effort_limit = 3.0});
  scene.options.effects.set(Effect::kEffortLimits, false);
  Simulator sim(std::move(scene));
  sim.input().applied_force[0] = 5.0;
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[0], sim.options().time_step * 5.0 / 2.0, kRoundoff);
  EXPECT_EQ(sim.effect_counts()[Effect::kEffortLimits], 0);
}

TEST(VelocityLimits, HoldTheSpeedOfAPushedBlockBothWays) {
  const double limit = 0.5, mass = 2.0, force = 40.0;
  for (const double sign : {1.0, -1.0}) {
    Scene scene = test::slider({.mass = mass, .velocity_limit = limit});
    scene.options.effects.set(Effect::kVelocityLimits, true);
    Simulator sim(std::move(scene));
    sim.input().applied_force[0] = sign * force;
    const double h = sim.options().time_step;
    double v = 0.0;
    // The row yields by r f = (eps / m) h F.
    const double give = sim.options().contact.compliance / mass * h * force;
    for (int i = 0; i < 200; ++i) {
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded());
      v = std::min(v + h * force / mass, limit);
      ASSERT_NEAR(sign * sim.state().v[0], v, give + kRoundoff) << i;
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      ASSERT_NEAR(inverse.applied_force[0], sign * force, 1e-8 * force) << i;
    }
  }
}

TEST(VelocityLimits, FromBelowHalfTheLimitTheNextStepBrakes) {
  // The force gives 20 m/s in one step; one step later the speed is at the limit.
  const double limit = 0.5;
  Scene scene = test::slider({.mass = 1.0, .velocity_limit = limit});
  scene.options.effects.set(Effect::kVelocityLimits, true);
  Simulator sim(std::move(scene));
  sim.input().applied_force[0] = 1e4;
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[0], 20.0, 1e-9);
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[0], limit, 1e-4);  // r f: 1e-6 of the 40 m/s removed
}

TEST(VelocityLimits, AreOffUnlessAskedFor) {
  Simulator sim(test::slider({.mass = 1.0, .velocity_limit = 0.5}));
  sim.input().applied_force[0] = 1e3;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[0], 20.0, 1e-9);
  EXPECT_EQ(sim.effect_counts()[Effect::kVelocityLimits], 0);
}

}  // namespace
}  // namespace counterpoint::motor_limits_test
