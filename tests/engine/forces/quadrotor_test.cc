// A quadrotor that hovers on DC motors and propellers: data/scenes/quadrotor.yaml.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/recover.h"

namespace counterpoint::quadrotor_test {
namespace {

constexpr int kHeight = 2;  // coordinate of the frame [m]

Simulator quadrotor() {
  return Simulator(load_scene(test::source_dir() + "/data/scenes/quadrotor.yaml"));
}

/// Its motors balance drag, its propellers weight, to the rounding of the numbers in the scene.
TEST(Quadrotor, Hovers) {
  Simulator sim = quadrotor();
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(sim.step().succeeded()) << i;
  EXPECT_NEAR(sim.state().q[kHeight], 1.0, 1e-9);
  EXPECT_NEAR(sim.state().q[3], 1.0, 1e-9);  // upright
}

/// One volt more on all motors: it rises, without turning, since their reactions cancel.
TEST(Quadrotor, RisesOnMoreVoltage) {
  Simulator sim = quadrotor();
  VectorX command(8);
  for (size_t i = 0; i < 8; ++i)
    command[static_cast<Eigen::Index>(i)] = sim.model().actuators()[i].command;
  for (int i = 0; i < 8; i += 2) command[i] += command[i] > 0.0 ? 1.0 : -1.0;
  sim.input().command = command;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded()) << i;
  EXPECT_GT(sim.state().q[kHeight], 1.5);
  EXPECT_NEAR(sim.state().q[3], 1.0, 1e-9);
}

/// A motor that speeds up turns the frame the other way: the momentum about the vertical grows by
/// the drag of its propeller alone.
TEST(Quadrotor, ReactionTurnsTheFrame) {
  Simulator sim = quadrotor();
  VectorX command(8);
  for (size_t i = 0; i < 8; ++i)
    command[static_cast<Eigen::Index>(i)] = sim.model().actuators()[i].command;
  for (const int i : {0, 4}) command[i] += 1.0;  // both that turn to the left
  sim.input().command = command;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(sim.step().succeeded()) << i;
  EXPECT_LT(sim.state().v[5], -0.01);
}

TEST(Quadrotor, InverseReturnsTheAppliedForces) {
  Simulator sim = quadrotor();
  test::Random random(2);
  EXPECT_LT(test::recover(sim, 300, 0.01, random), test::kRecovered);
}

}  // namespace
}  // namespace counterpoint::quadrotor_test
