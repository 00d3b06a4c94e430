// Dry friction of joints that falls from its break-away level with speed:
// F(v) = F_c + (F_s - F_c) exp(-(v / v_s)^2).
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "counterpoint/engine/simulator.h"
#include "support/recover.h"
#include "support/small_scenes.h"
#include "support/step_derivatives.h"

namespace counterpoint::breakaway_friction_test {
namespace {

constexpr double kMass = 2.0, kMoving = 3.0, kRest = 5.0;  // [kg], [N], [N]

/// A block with this friction at rest [N] and Stribeck speed [m/s].
Scene block(double stribeck_speed, double at_rest = kRest, double moving = kMoving) {
  return test::slider({.mass = kMass,
                       .dry_friction = moving,
                       .breakaway_friction = at_rest,
                       .stribeck_speed = stribeck_speed});
}

/// Speed [m/s] below which smoothing and compliance let a block creep that friction holds: friction
/// reaches a share of its bound F at v^2 = share^2 ((r F)^2 + 4 r k / (1 - share^2)), see
/// dry_friction_test.cc.
double creep(const Scene& scene, double share) {
  const ContactOptions& contact = scene.options.contact;
  const double r = contact.compliance / kMass, k = contact.smoothing * kStandardGravity * kMass;
  const double give = r * kRest * scene.options.time_step;
  return share * std::sqrt(give * give + 4.0 * r * k / (1.0 - share * share));
}

TEST(BreakawayFriction, HoldsUpToItsBoundThenSlidesWithDryFriction) {
  const Scene scene = block(0.01);
  Simulator sim(scene);
  sim.input().applied_force[0] = 0.99 * kRest;  // well above kMoving
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
  // Creep of 1e-8 m/s takes 1e-12 of the excess away.
  EXPECT_NEAR(sim.state().v[0], creep(scene, 0.99), 1e-6 * creep(scene, 0.99));
  EXPECT_LT(sim.state().v[0], 5e-8);
  sim.input().applied_force[0] = 1.01 * kRest;
  const auto run = [&](double until) {
    while (sim.state().v[0] < until) ASSERT_TRUE(sim.step().succeeded());
  };
  run(0.1);  // ten times the Stribeck speed: exp(-100) of the excess is left
  const State first = sim.state();
  run(0.5);
  // The bound enters the step as a constant; rounding, and smoothing of 1e-18 / v^2 of the bound.
  EXPECT_NEAR(sim.state().v[0] - first.v[0],
              (1.01 * kRest - kMoving) / kMass * (sim.state().time - first.time), 1e-11);
}

TEST(BreakawayFriction, HoldsThePendulumThatDryFrictionWouldLetGo) {
  const double q0 = 0.6, torque = 9.81 * std::sin(q0);
  Scene scene = test::pendulum({.dry_friction = 0.5 * torque});
  scene.q[0] = q0;
  const auto moved = [&](double at_rest) {
    ModelEditor editor(scene.model);
    editor.set_breakaway_friction(0, at_rest);
    Scene with = scene;
    with.model = editor.take();
    Simulator sim(with);
    for (int i = 0; i < 300; ++i) EXPECT_TRUE(sim.step().succeeded());
    return q0 - sim.state().q[0];
  };
  EXPECT_NEAR(moved(1.1 * torque), 0.0, 1e-8);  // creep of 1e-8 rad/s for 0.3 s
  EXPECT_GT(moved(0.9 * torque), 0.1);
  EXPECT_GT(moved(0.0), moved(0.9 * torque));
}

// The step takes the bound at its start: explicit Euler of m v' = -F(v), of first order.
TEST(BreakawayFriction, ASlowingBlockFollowsTheDifferentialEquation) {
  constexpr double kSpeed = 0.05, kStart = 0.2, kSeconds = 0.1;  // stops after 0.11 s
  const auto slope = [](double v) {
    return -(kMoving + (kRest - kMoving) * std::exp(-v * v / (kSpeed * kSpeed))) / kMass;
  };
  double fine = kStart;  // Runge-Kutta of order 4, in 1e5 steps: rounding
  constexpr double h = 1e-6;
  for (int i = 0; i < 100000; ++i) {
    const double a = slope(fine), b = slope(fine + 0.5 * h * a), c = slope(fine + 0.5 * h * b);
    fine += h / 6.0 * (a + 2.0 * b + 2.0 * c + slope(fine + h * c));
  }
  ASSERT_GT(fine, 0.01);
  const auto error = [&](double step) {
    Scene scene = block(kSpeed);
    scene.options.time_step = step;
    scene.v[0] = kStart;
    Simulator sim(scene);
    for (int i = 0; i < std::lround(kSeconds / step); ++i) EXPECT_TRUE(sim.step().succeeded());
    return sim.state().v[0] - fine;
  };
  const double coarse = error(1e-4), half = error(5e-5);
  // Euler's method: h T / 2 max |v''|, with v'' = F F' / m^2 and |F F'| < 5 N 34 N s/m.
  EXPECT_LT(std::abs(coarse), 0.5 * 1e-4 * kSeconds * 5.0 * 34.0 / (kMass * kMass));
  EXPECT_NEAR(coarse / half, 2.0, 0.02);  // the next order is h |dF/dv| / m = 0.3 % of the error
}

// A spring pulls the block at constant speed: it sticks and slips. For v_s -> 0 the extension of
// the spring swings about F_c / k with the amplitude A = (F_s - F_c) / k while the block slides.
TEST(BreakawayFriction, StickSlipHasItsPeriodAndIsInvertedAndTakesEnergy) {
  constexpr double kStiffness = 100.0, kPull = 0.05, kStep = 1e-4;  // [N/m], [m/s], [s]
  Scene scene = block(2e-5);
  scene.options.time_step = kStep;
  scene.options.contact.smoothing = 0.0;  // else the block creeps by um/s below the bound
  Simulator sim(std::move(scene));
  const double w = std::sqrt(kStiffness / kMass), A = (kRest - kMoving) / kStiffness;
  std::vector<double> starts;
  double error = 0.0, work = -1.0;
  bool slides = false;
  while (starts.size() < 4 && sim.state().time < 20.0) {
    const double force = kStiffness * (kPull * sim.state().time - sim.state().q[0]);
    sim.input().applied_force[0] = force;
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    const double v = sim.state().v[0];
    error = std::max(
        error, std::abs(sim.inverse(before.q, before.v, sim.state().v).applied_force[0] - force));
    work = std::max(work, (kMass * (v - before.v[0]) / kStep - force) * v);
    const bool moves = v > 0.1 * A * w;
    if (moves && !slides) starts.push_back(before.time);
    slides = moves;
  }
  ASSERT_EQ(starts.size(), 4u);
  const double period = 2.0 * A / kPull + 2.0 / w * (std::numbers::pi - std::atan(A * w / kPull));
  // The block leaves v = 0 as exp(t (F_s - F_c) / (m v_s)) at most, within some ms.
  EXPECT_NEAR((starts[3] - starts[1]) / 2.0, period, 0.005 * period);
  EXPECT_LT(error, 1e-9);  // rounding of v, 1e-17 m/s while it sticks, over r h = 1e-9 s/kg
  EXPECT_LE(work, 1e-11);  // friction opposes v at the end of the step, to rounding of its force
}

TEST(BreakawayFriction, NeverSpeedsUpAFreeBlock) {
  test::Random random(5);
  for (int run = 0; run < 50; ++run) {
    const double moving = random.uniform(0.0, 3.0);
    Scene scene =
        block(std::pow(10.0, random.uniform(-5.0, 0.0)), moving + random.uniform(0.0, 9.0), moving);
    scene.options.time_step = std::pow(10.0, random.uniform(-4.0, -1.0));
    scene.v[0] = random.uniform(-0.5, 0.5);
    Simulator sim(std::move(scene));
    for (int i = 0; i < 100; ++i) {
      const double before = std::abs(sim.state().v[0]);
      ASSERT_TRUE(sim.step().succeeded());
      ASSERT_LE(std::abs(sim.state().v[0]), before);
    }
  }
}

/// A random tree with friction curves in all joints.
Scene tree(int seed, test::Random& random) {
  test::RandomModelOptions options;
  options.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
  options.damping = options.armature = seed % 3 == 0;
  options.dry_friction = true;
  Scene scene = test::make_random_scene(seed, options, random);
  ModelEditor editor(scene.model);
  for (int k = 0; k < scene.model.nv(); ++k) {
    const double dry = scene.model.dry_friction()[k];
    if (!(dry > 0.0)) continue;
    editor.set_breakaway_friction(k, dry + random.uniform(0.0, 2.0));
    editor.set_stribeck_speed(k, random.uniform(0.1, 1.0));
  }
  scene.model = editor.take();
  return scene;
}

TEST(BreakawayFriction, OfTreesIsRecoveredByTheInverse) {
  for (int seed = 0; seed < 10; ++seed) {
    test::Random random(seed);
    Simulator sim(tree(seed, random));
    EXPECT_LT(test::recover(sim, 50, 1.0, random), test::kRecovered) << "seed " << seed;
  }
}

TEST(BreakawayFriction, DerivativesAreExact) {
  for (int seed = 0; seed < 10; ++seed) {
    test::Random random(100 + seed);
    Scene scene = tree(seed, random);
    scene.options.time_step = 0.01;  // M (w+ - w) / h is rounded less
    test::soften(scene);
    scene.v *= 0.2;  // about the Stribeck speeds
    test::expect_exact(scene, test::random_moment(scene, random, 0.1),
                       "seed " + std::to_string(seed));
  }
}

TEST(BreakawayFriction, ASlidingBlockLosesTheSlopeOfItsCurve) {
  constexpr double kSpeed = 0.1, kStart = 0.08;
  Scene scene = block(kSpeed);
  scene.v[0] = kStart;
  const test::Moment at = test::moment_of(scene, 0);
  Workspace ws(scene.model);
  Inverse inverse;
  InverseDerivatives by_inverse;
  ForwardDerivatives d;
  ASSERT_TRUE(step_forward_derivatives(scene.model, scene.options, at.q, at.v, at.v_next, at.known,
                                       ws, inverse, by_inverse, d));
  const double ratio = kStart / kSpeed;
  const double slope = -2.0 * (kRest - kMoving) * ratio / kSpeed * std::exp(-ratio * ratio);
  // Smoothing: friction of a sliding block misses its bound by 1e-16.
  EXPECT_NEAR(d.dv_dv(0, 0), 1.0 - scene.options.time_step * slope / kMass, 1e-12);
}

/// Velocities of a block under random forces.
VectorX speeds(const Scene& scene) {
  Simulator sim(scene);
  test::Random random(7);
  VectorX out(300);
  for (int i = 0; i < out.size(); ++i) {
    sim.input().applied_force[0] = random.uniform(-9.0, 9.0);
    EXPECT_TRUE(sim.step().succeeded());
    out[i] = sim.state().v[0];
  }
  return out;
}

TEST(BreakawayFriction, WithoutExcessOrSwitchedOffItChangesNoBit) {
  const VectorX dry = speeds(block(0.05, 0.0));
  EXPECT_EQ(speeds(block(0.05, kMoving)), dry);
  Scene scene = block(0.05);
  EXPECT_NE(speeds(scene), dry);
  scene.options.effects.set(Effect::kBreakawayFriction, false);
  EXPECT_EQ(speeds(scene), dry);
}

TEST(BreakawayFriction, MayBeAllThatThereIs) {
  Scene scene = block(0.05, kRest, 0.0);
  Simulator rest(scene);
  rest.input().applied_force[0] = 0.9 * kRest;
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(rest.step().succeeded());
  EXPECT_LT(rest.state().v[0], 1e-7);
  scene.v[0] = 1.0;  // exp(-400) of the friction is left
  Simulator slides(scene);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(slides.step().succeeded());
  EXPECT_EQ(slides.state().v[0], 1.0);
}

}  // namespace
}  // namespace counterpoint::breakaway_friction_test
