// Gears, racks and backlash: fixed tendons with limits.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/recover.h"

namespace counterpoint::gears_test {
namespace {

constexpr double kFirst = 0.2, kSecond = 0.6;  // inertias [kg m^2], or masses [kg]

/// Two bodies on joints of their own, "first" a wheel, "second" a wheel or, on a slide, a rack; a
/// tendon, first - ratio second, keeps its length within the limits. Without gravity.
Scene geared(JointType second, double ratio, double lower, double upper) {
  ModelBuilder builder(Vector3::Zero());
  const auto add = [&](const std::string& name, JointType type, double inertia) {
    RobotSpec robot;
    robot.name = name;
    LinkSpec base, body;
    base.name = name + " base";
    body.name = name + " body";
    body.inertia.mass = inertia;
    body.inertia.rotational = inertia * Matrix3::Identity();
    robot.links = {base, body};
    JointSpec joint;
    joint.name = name;
    joint.type = type;
    joint.parent = base.name;
    joint.child = body.name;
    joint.axis = Vector3::UnitZ();
    robot.joints = {joint};
    builder.add_robot(robot, Base::kFixed, Pose());
  };
  add("first", JointType::kRevolute, kFirst);
  add("second", second, kSecond);
  TendonSpec gear;
  gear.joints = {{"first", 1.0}, {"second", -ratio}};
  gear.lower = lower;
  gear.upper = upper;
  builder.add_tendon(gear);
  return scene_of(builder.build());
}

/// Limits that are equal couple two joints: a torque u at the first accelerates it by
/// u / (I_1 + I_2 / ratio^2), and the second by 1 / ratio of that; for a rack, ratio is 1 / radius.
TEST(Gears, EqualLimitsAreAGearOrARack) {
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic}) {
    for (const double ratio : {3.0, -0.5}) {
      Simulator sim(geared(type, ratio, 0.0, 0.0));
      sim.settings().tolerance = 1e-12;
      sim.input().applied_force = Eigen::Vector2d(1.5, 0.0);
      for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
      const double speed = 1.0 * 1.5 / (kFirst + kSecond / (ratio * ratio));
      // The limits yield by their compliance, 1e-6.
      EXPECT_NEAR(sim.state().v[0], speed, 1e-5 * speed) << ratio;
      EXPECT_NEAR(sim.state().v[1], speed / ratio, 1e-5 * std::abs(speed / ratio)) << ratio;
      EXPECT_NEAR(sim.state().q[0], ratio * sim.state().q[1], 1e-7) << ratio;
    }
  }
}

/// Rounding of w+ over the compliance of the limits grows with the speed: at 5 rad/s, after a
/// second of this, torques come back to 2e-9.
TEST(Gears, InverseRecoversTheTorques) {
  Simulator sim(geared(JointType::kRevolute, 3.0, 0.0, 0.0));
  test::Random random(1);
  EXPECT_LT(test::recover(sim, 100, 1.0, random), test::kRecovered);
}

/// Within its play the first wheel turns alone; when it meets the second, both go on with the
/// common momentum of an impact without bounce.
TEST(Gears, BacklashLetsTheFirstRunAhead) {
  constexpr double kPlay = 0.1;  // [rad]
  Simulator sim(geared(JointType::kRevolute, 1.0, -0.5 * kPlay, 0.5 * kPlay));
  State start = sim.state();
  start.v[0] = 2.0;
  sim.set_state(start);
  double met = -1.0;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    if (met < 0.0 && sim.state().v[1] > 1e-3) met = sim.state().time;
    EXPECT_LT(sim.state().q[0] - sim.state().q[1], 0.5 * kPlay + 1e-6);
    if (met < 0.0) {
      EXPECT_NEAR(sim.state().v[0], 2.0, 1e-9);
    }
  }
  EXPECT_NEAR(met, 0.5 * kPlay / 2.0, 0.0021);  // a step
  const double common = 2.0 * kFirst / (kFirst + kSecond);
  EXPECT_NEAR(sim.state().v[0], common, 1e-4);
  EXPECT_NEAR(sim.state().v[1], common, 1e-4);
}

}  // namespace
}  // namespace counterpoint::gears_test
