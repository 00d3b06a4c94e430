// Limits of ball joints: the angle of rotation stays within them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "support/recover.h"
#include "support/step_derivatives.h"

namespace counterpoint::ball_limits_test {
namespace {

constexpr double kLimit = 0.7;  // [rad]

/// A rod of 1 m and 2 kg that hangs from a ball joint "hip", its mass in the middle.
Scene rod(double limit = kLimit) {
  RobotSpec robot;
  robot.name = "rod";
  LinkSpec base, leg;
  base.name = "base";
  leg.name = "leg";
  leg.inertia.mass = 2.0;
  leg.inertia.center = {0, 0, -0.5};
  leg.inertia.rotational = Vector3(0.67, 0.67, 0.01).asDiagonal();
  robot.links = {base, leg};
  JointSpec joint;
  joint.name = "hip";
  joint.type = JointType::kSpherical;
  joint.parent = "base";
  joint.child = "leg";
  joint.upper = limit;
  joint.damping = 0.05;
  robot.joints = {joint};
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  return scene_of(builder.build());
}

double angle(const State& state) {
  return quaternion_log(Quaternion(state.q[0], state.q[1], state.q[2], state.q[3])).norm();
}

/// Swings against the limit about several axes, spinning too.
TEST(BallLimits, TheAngleStaysWithinThem) {
  for (const Vector3& speed : {Vector3(4, 0, 0), Vector3(-3, 3, 1), Vector3(0.5, 0.2, 30)}) {
    Simulator sim(rod());
    State start = sim.state();
    start.v = speed;
    sim.set_state(start);
    double most = 0.0, fastest = 0.0;
    for (int i = 0; i < 2000; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      most = std::max(most, angle(sim.state()));
      fastest = std::max(fastest, sim.state().v.norm());
    }
    EXPECT_GT(most, kLimit - 0.01) << speed.transpose();
    // The axis turns by h w within a step, so that the angle passes by (h w)^2 / 2, of which each
    // further step recovers a fifth.
    const double turn = sim.options().time_step * fastest;
    EXPECT_LT(most, kLimit + 2.5 * turn * turn) << speed.transpose();
  }
}

/// Held against the limit by a torque T about x: the limit carries T less gravity's torque.
TEST(BallLimits, CarryTheTorqueThatHoldsAgainstThem) {
  Simulator sim(rod());
  sim.input().applied_force = Vector3(20, 0, 0);
  for (int i = 0; i < 5000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(angle(sim.state()), kLimit, 1e-6);
  const Inverse& inverse = sim.last_forces();
  const double gravity = 2.0 * kStandardGravity * 0.5 * std::sin(kLimit);
  ASSERT_EQ(inverse.joints.size(), 3u);
  EXPECT_EQ(inverse.joints[0].effect, Effect::kLimits);
  EXPECT_NEAR(inverse.joints[0].force, -(20.0 - gravity), 1e-4);
  EXPECT_NEAR(inverse.joints[1].force, 0.0, 1e-6);
}

TEST(BallLimits, InverseRecoversAppliedTorques) {
  Simulator sim(rod());
  test::Random random(3);
  EXPECT_LT(test::recover(sim, 1000, 15.0, random), test::kRecovered);
}

/// The direction of the row turns with the joint: derivatives are differences, and say so.
TEST(BallLimits, DerivativesAreDifferencesAtTheLimit) {
  Simulator sim(rod());
  sim.input().applied_force = Vector3(20, 3, 1);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  Workspace workspace(sim.model());
  Inverse inverse;
  InverseDerivatives d;
  step_inverse_derivatives(sim.model(), sim.options(), before.q, before.v, sim.state().v,
                           sim.input(), workspace, inverse, d);
  EXPECT_TRUE(d.by_differences);
  EXPECT_TRUE(d.dq.allFinite());
}

TEST(BallLimits, LimitsOfHalfATurnAndMoreAreRefused) {
  EXPECT_THROW(rod(3.2), InputError);
  EXPECT_THROW(rod(0.0), InputError);
  EXPECT_THROW(rod(-1.0), InputError);
}

}  // namespace
}  // namespace counterpoint::ball_limits_test
