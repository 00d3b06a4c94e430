// Gravity compensation: compensating a share s of all weights equals gravity (1 - s) g for every
// mechanism; share 1 leaves it at rest.
#include "counterpoint/engine/dynamics/gravity_compensation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/model_builder.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::gravity_compensation_test {
namespace {

constexpr double kG = 9.81;
/// Rounding of otherwise equal steps at velocities up to 10 rad/s, amplified by the motion.
constexpr double kRoundoff = 1e-9;
constexpr Integrator kIntegrators[] = {Integrator::kSemiImplicitEuler,
                                       Integrator::kImplicitMidpoint, Integrator::kRungeKutta4};

/// A random tree under oblique gravity of size g; every link compensates `share` of its weight.
Model tree(int seed, Base base, int links, double g, double share) {
  RobotSpec robot =
      test::make_random_robot(seed, {.links = links, .base = base, .damping = seed % 2 == 0});
  for (LinkSpec& link : robot.links) link.gravity_compensation = share;
  ModelBuilder builder(g * Vector3(0.36, 0.48, -0.8));
  builder.add_robot(robot, base, Pose());
  return builder.build();
}

Simulator at_random(Model model, Integrator integrator, double speed) {
  const VectorX q = test::random_configuration(model, 5);
  const VectorX v = test::random_vector(model.nv(), 6, speed);
  Scene scene{"tree", std::move(model), q, v, {}};
  scene.options.integrator = integrator;
  return Simulator(std::move(scene));
}

double potential(const Simulator& sim) {
  Data data(sim.model());
  compute_poses(sim.model(), sim.state().q, data);
  return potential_energy(sim.model(), data);
}

class GravityCompensated : public ::testing::TestWithParam<Integrator> {};

TEST_P(GravityCompensated, AllOfTheWeightIsRestInAnyPose) {
  for (int seed = 0; seed < 8; ++seed) {
    Simulator sim = at_random(tree(seed, seed % 2 ? Base::kFixed : Base::kFloating, 7, kG, 1.0),
                              GetParam(), 0.0);
    const VectorX q = sim.state().q;
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(sim.step().succeeded());
    EXPECT_LT((sim.state().q - q).cwiseAbs().maxCoeff(), kRoundoff) << seed;
    EXPECT_LT(std::abs(potential(sim)), kRoundoff) << seed;
  }
}

TEST_P(GravityCompensated, AShareOfAllIsSoMuchLessGravity) {
  constexpr double kShare = 0.375;
  const std::pair<Base, int> kinds[] = {
      {Base::kFixed, 6}, {Base::kFloating, 5}, {Base::kFloating, 1}, {Base::kSpherical, 1}};
  for (int seed = 0; seed < 12; ++seed) {
    const auto [base, links] = kinds[seed % 4];
    Simulator carried = at_random(tree(seed, base, links, kG, kShare), GetParam(), 1.0);
    Simulator light = at_random(tree(seed, base, links, (1.0 - kShare) * kG, 0.0), GetParam(), 1.0);
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(carried.step().succeeded());
      ASSERT_TRUE(light.step().succeeded());
    }
    EXPECT_LT((carried.state().q - light.state().q).cwiseAbs().maxCoeff(), kRoundoff) << seed;
    EXPECT_LT((carried.state().v - light.state().v).cwiseAbs().maxCoeff(), 10 * kRoundoff) << seed;
    EXPECT_NEAR(potential(carried), potential(light), 10 * kRoundoff) << seed;
  }
}

TEST_P(GravityCompensated, TheInverseDoesNotTakeItForAnAppliedForce) {
  if (GetParam() == Integrator::kRungeKutta4) return;  // no inverse
  for (int seed = 0; seed < 6; ++seed) {
    test::RandomModelOptions o;
    o.links = 5;
    o.base = seed % 2 ? Base::kFixed : Base::kFloating;
    o.compensations = true;
    Simulator sim = at_random(test::make_random_model(seed, o), GetParam(), 1.0);
    ASSERT_FALSE(sim.model().gravity_compensations().empty());
    for (int i = 0; i < 20; ++i) {
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded());
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), kRoundoff) << seed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EachIntegrator, GravityCompensated, ::testing::ValuesIn(kIntegrators));

/// Semi-implicit Euler by hand: the remaining weight of a point mass acts on the pendulum.
TEST(GravityCompensation, PendulumOfHalfItsWeightIsTheSchemeByHand) {
  const double l = 0.7, h = 0.01;
  Scene scene = test::pendulum({.mass = 1.3, .length = l, .gravity_compensation = 0.5});
  scene.options.time_step = h;
  scene.q[0] = 0.9;
  Simulator sim(std::move(scene));
  double q = 0.9, w = 0.0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    w -= h * 0.5 * kG / l * std::sin(q);
    q += h * w;
    ASSERT_NEAR(sim.state().q[0], q, 1e-12) << i;
  }
}

TEST(GravityCompensation, GoesWithTheEffectOfGravity) {
  for (const bool on : {true, false}) {
    Scene scene = test::free_ball({.gravity = {0, 0, -kG}, .gravity_compensation = 3.0});
    scene.options.effects.set(Effect::kGravity, on);
    const double h = scene.options.time_step;
    Simulator sim(std::move(scene));
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_NEAR(sim.state().v[2], on ? 2.0 * kG * h : 0.0, 1e-15);  // rounding; at share 3 it rises
  }
}

/// A bouncing ball: the arc between bounces is that of the remaining gravity.
TEST(GravityCompensation, BouncesKnowHowFastABodyFalls) {
  test::BallOnPlane ball;
  ball.height = 0.2;
  ball.material.restitution = 0.8;
  std::vector<double> at[2];
  for (const int light : {0, 1}) {
    Scene scene = test::ball_on_plane(ball);
    ModelEditor editor(scene.model);
    if (light) editor.set_gravity(0.5 * scene.model.gravity());
    scene.model = light ? editor.take()
                        : test::ball_on_plane([&] {
                            test::BallOnPlane carried = ball;
                            carried.gravity_compensation = 0.5;
                            return carried;
                          }())
                              .model;
    Simulator sim(std::move(scene));
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      at[light].push_back(sim.state().q[2]);
    }
  }
  // Both fall 0.2 m and rise again; distant contacts push a little, sooner under more gravity.
  for (size_t i = 0; i < at[0].size(); ++i) ASSERT_NEAR(at[0][i], at[1][i], 1e-6) << i;
}

TEST(GravityCompensation, AnotherShareIsAnotherModel) {
  const Model none = tree(1, Base::kFixed, 4, kG, 0.0), half = tree(1, Base::kFixed, 4, kG, 0.5);
  EXPECT_NE(model_hash(none), model_hash(half));
  EXPECT_EQ(none.gravity_compensations().size(), 0u);
}

}  // namespace
}  // namespace counterpoint::gravity_compensation_test
