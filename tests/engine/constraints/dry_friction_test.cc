// Dry joint friction: Coulomb's law in one coordinate, sticking, sliding, and inverted.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::dry_friction_test {
namespace {

/// Speed [m/s] at which friction reaches a share of its bound F: f = -2 F v / (s1 + s2) with s =
/// sqrt((v -+ r F)^2 + 4 r k) gives v^2 = share^2 ((r F)^2 + 4 r k / (1 - share^2)).
double creep(const Simulator& sim, double mass, double friction, double share) {
  const ContactOptions& contact = sim.options().contact;
  const double r = contact.compliance / mass, k = contact.smoothing * kStandardGravity * mass;
  const double give = r * friction * sim.options().time_step;
  return share * std::sqrt(give * give + 4.0 * r * k / (1.0 - share * share));
}

/// Friction at its bound enters the step as a constant. The remaining error is rounding and the
/// smoothing, 2 r k / v^2 of the bound (1e-18 / v^2 at the defaults).
constexpr double kRoundoff = 1e-11;

TEST(DryFriction, SlidingBlockDeceleratesByFrictionOverMassStopsAndStays) {
  const double mass = 2.0, friction = 3.0, v0 = 1.0;
  Simulator sim(test::slider({.mass = mass, .dry_friction = friction}));
  const double h = sim.options().time_step;
  State start = sim.state();
  start.v[0] = v0;
  sim.set_state(start);
  double v = v0, x = 0.0;
  int steps = 0;
  for (;; ++steps) {
    const double loss = h * friction / mass;
    const double expected = v > loss ? v - loss : creep(sim, mass, friction, v / loss);
    ASSERT_TRUE(sim.step().succeeded()) << "step " << steps;
    ASSERT_NEAR(sim.state().v[0], expected, kRoundoff) << "step " << steps;
    if (v < loss) break;
    v = expected;
    x += h * v;
  }
  EXPECT_EQ(steps + 1, std::ceil(v0 * mass / (friction * h)));
  EXPECT_NEAR(sim.state().q[0], x, kRoundoff);
  const double stopped = sim.state().q[0];
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
  // No load acts at rest: the block stays where its last creep of 1e-9 m/s brings it.
  EXPECT_NEAR(sim.state().q[0], stopped, 1e-14);
}

TEST(DryFriction, LoadBelowTheBoundCreepsByTheCompliance) {
  const double mass = 2.0, friction = 3.0;
  for (const double share : {0.1, 0.5, 0.9}) {
    Simulator sim(test::slider({.mass = mass, .dry_friction = friction}));
    sim.input().applied_force[0] = share * friction;
    for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
    const double expected = creep(sim, mass, friction, share);
    EXPECT_LT(expected, 5e-9);
    EXPECT_NEAR(sim.state().v[0], expected, 1e-6 * expected) << share;
  }
}

TEST(DryFriction, LoadAboveTheBoundAcceleratesByTheRest) {
  const double mass = 2.0, friction = 3.0, force = 5.0;
  Simulator sim(test::slider({.mass = mass, .dry_friction = friction}));
  sim.input().applied_force[0] = force;
  const int steps = 500;
  for (int i = 0; i < steps; ++i) ASSERT_TRUE(sim.step().succeeded());
  const double v = (force - friction) / mass * steps * sim.options().time_step;
  EXPECT_NEAR(sim.state().v[0], v, kRoundoff);
}

TEST(DryFriction, HoldsThePendulumItCanHoldAndSlowsTheOneItCannot) {
  const double q0 = 0.6, torque = 9.81 * std::sin(q0);
  for (const double friction : {1.1 * torque, 0.5 * torque}) {
    Scene scene = test::pendulum({.dry_friction = friction});
    scene.q[0] = q0;
    Simulator sim(std::move(scene));
    const double h = sim.options().time_step;
    double q = q0, v = 0.0;
    for (int i = 0; i < 200; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      // Unit inertia; friction stops the pendulum if it can within the step.
      const double free = v - h * 9.81 * std::sin(q);
      v = std::copysign(std::max(0.0, std::abs(free) - h * friction), free);
      q += h * v;
    }
    // 200 steps of creep; where it slides, rounding and smoothing in the first slow steps.
    EXPECT_NEAR(sim.state().q[0], q, 200 * h * creep(sim, 1.0, friction, 1.0 / 1.1)) << friction;
    if (friction > torque) {
      EXPECT_EQ(q, q0);
    } else {
      EXPECT_LT(q, q0 - 0.01);
    }
  }
}

TEST(DryFriction, TakesOnlyThisJoint) {
  Simulator sim(test::slider({.mass = 1.0}));
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_EQ(sim.step().constraint_rows, 0);
  Simulator dry(test::slider({.mass = 1.0, .dry_friction = 1e-3}));
  EXPECT_EQ(dry.step().constraint_rows, 1);
}

TEST(DryFriction, IsRecoveredByTheInverse) {
  // The friction of a sliding joint has no slope; a sticking joint hardly moves, and w is rounded
  // relative to itself: measured 2e-10 at most.
  constexpr double kRecovered = 1e-9;
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
    options.damping = options.armature = seed % 3 == 0;
    options.dry_friction = true;
    Scene scene = test::make_random_scene(seed, options, random);
    Simulator sim(std::move(scene));
    sim.settings().tolerance = 1e-12;  // the solver's error must not hide the inverse's
    double error = 0.0, scale = 0.0;
    int rows = 0;
    for (int i = 0; i < 50; ++i) {
      if (i % 10 == 0)
        sim.input().applied_force = test::random_vector(sim.model().nv(), random.bits());
      const State before = sim.state();
      const StepReport report = sim.step();
      ASSERT_TRUE(report.succeeded())
          << seed << " step " << i << ": " << contact::status_name(report.status);
      rows += report.constraint_rows;
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      error = std::max(error,
                       (inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff());
      scale = std::max(scale, inverse.force_scale);
    }
    EXPECT_GT(rows, 0);
    EXPECT_LT(error / scale, kRecovered) << "seed " << seed;
  }
}

}  // namespace
}  // namespace counterpoint::dry_friction_test
