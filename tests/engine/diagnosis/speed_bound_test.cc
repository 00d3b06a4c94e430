// A step fails where something moves faster than the bound, and the fault names the cause.
#include <gtest/gtest.h>

#include <limits>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "support/small_scenes.h"
#include "support/temp_folder.h"

namespace counterpoint::speed_bound_test {
namespace {

using contact::Status;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Scene read(const std::string& yaml) {
  const test::TempFolder folder;
  return load_scene(folder.write("scene.yaml", yaml));
}

TEST(Fault, ARunawayIsStoppedWhereItPassesTheBound) {
  Simulator sim(test::slider({.mass = 2.0}));
  sim.input().applied_force[0] = 1e9;
  int steps = 0;
  StepReport report = sim.step();
  for (; report.succeeded() && steps < 1000; ++steps) report = sim.step();
  // 1e9 N on 2 kg for 2 ms: 1e6 m/s, above the bound in the first step.
  EXPECT_EQ(steps, 0);
  EXPECT_EQ(report.status, Status::kDiverged);
  // 7e5 N: 700 m/s a step, 1e5 m/s in step 143.
  sim.input().applied_force[0] = 7e5;
  while ((report = sim.step()).succeeded()) ++steps;
  EXPECT_EQ(steps, 142);
  EXPECT_EQ(report.fault.kind, FaultKind::kSpeed);
  EXPECT_EQ(report.fault.cause, SpeedCause::kDriven);
  EXPECT_EQ(describe(sim.model(), report.fault).element, "slide.v");
  EXPECT_NEAR(report.fault.value, 143 * 700.0, 1e-6);  // a sum of 143 numbers of 1e5
  EXPECT_EQ(report.fault.bound, kDefaultMaxSpeed);
  EXPECT_NEAR(sim.state().v[0], 142 * 700.0, 1e-6);  // the last good state
  sim.options().max_speed = kInfinity;
  EXPECT_TRUE(sim.step().succeeded());
}

TEST(Fault, ServosSpringsWrenchesAndGravityDriveToo) {
  const auto cause_of = [](Simulator& sim) {
    StepReport report = sim.step();
    for (int k = 0; k < 100000 && report.succeeded(); ++k) report = sim.step();
    EXPECT_EQ(report.status, Status::kDiverged);
    return report.fault.cause;
  };
  test::Slider with_servo;
  with_servo.servo.damping = 10.0;
  with_servo.servo.velocity = 1e7;
  Simulator servo(test::slider(with_servo));
  EXPECT_EQ(cause_of(servo), SpeedCause::kDriven);
  Simulator spring(test::slider({.stiffness = 1.0, .reference = 1e6}));
  EXPECT_EQ(cause_of(spring), SpeedCause::kDriven);
  Simulator fall(test::free_ball({.gravity = Vector3(0, 0, -1e5)}));
  EXPECT_EQ(cause_of(fall), SpeedCause::kDriven);
  Simulator pushed(test::free_ball({}));
  ExternalWrench wrench;
  wrench.body = 1;
  wrench.wrench.torque.y() = 1e6;
  pushed.input().wrenches = {wrench};
  EXPECT_EQ(cause_of(pushed), SpeedCause::kDriven);
  Simulator given(test::free_ball({}));
  State fast = given.state();
  fast.v[1] = 2e5;
  given.set_state(fast);
  EXPECT_EQ(cause_of(given), SpeedCause::kGiven);
}

/// The bound is on the speed of mass, not on angular velocity: 1e4 rad/s is 1 km/s at 0.1 m.
TEST(Fault, FastSpinsAreFine) {
  Simulator sim(test::free_ball({}));
  State state = sim.state();
  state.v.tail<3>() = Vector3(1e4, -2e4, 3e4);
  sim.set_state(state);
  for (int k = 0; k < 1000; ++k) ASSERT_TRUE(sim.step().succeeded()) << k;
}

TEST(Fault, TheSceneFileSetsTheBound) {
  const std::string ball = "models:\n  - {name: ball, sphere: 0.1, mass: 1}\n";
  EXPECT_EQ(read(ball).options.max_speed, kDefaultMaxSpeed);
  EXPECT_EQ(read(ball + "max_speed: 7\n").options.max_speed, 7.0);
  EXPECT_EQ(read(ball + "max_speed: none\n").options.max_speed, kInfinity);
  for (const char* bad : {"0", "-1", "fast", "[1]"})
    EXPECT_THROW(read(ball + "max_speed: " + bad + "\n"), InputError) << bad;
}

/// Free fall at 9.80665 m/s^2: 7 m/s after 0.714 s, in step 357 of 2 ms.
TEST(Fault, ABoundOfTheSceneIsKept) {
  Simulator sim(read("models:\n  - {name: ball, sphere: 0.1, mass: 1}\nmax_speed: 7\n"));
  int steps = 0;
  while (sim.step().succeeded()) ++steps;
  EXPECT_EQ(steps, 356);
}

}  // namespace
}  // namespace counterpoint::speed_bound_test
