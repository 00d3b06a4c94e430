// Derivatives of sensor values against closed forms, and through a step against whole steps.
#include "counterpoint/engine/sensors/sensor_derivatives.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/sensors/sensed.h"
#include "support/arm_spec.h"
#include "support/small_scenes.h"

namespace counterpoint::sensor_derivatives_test {
namespace {

using test::imu;
using test::Sensed;
using test::sensor;

constexpr double kGravity = 9.81;  // [m/s^2]
/// Rounding of the values over the steps of the differences, relative to the largest entry of a
/// row: 1e-16 / 1e-6 and a margin of 10 where an inverse step is differentiated, else less.
constexpr double kDerivative = 1e-9;

SensorDerivatives derivatives_of(Sensed& run) {
  SensorDerivatives d;
  const State& after = run.simulator.state();
  const SimulationOptions& options = run.simulator.options();
  sensor_derivatives(
      run.simulator.model(), options,
      {run.before.q, run.before.v, after.q, after.v, run.simulator.input(), options.time_step},
      run.table, d);
  return d;
}

SensorResponse response_of(Sensed& run) {
  Workspace workspace(run.simulator.model());
  Inverse inverse;
  InverseDerivatives d_inverse;
  ForwardDerivatives forward;
  EXPECT_TRUE(step_forward_derivatives(run.simulator.model(), run.simulator.options(),
                                       run.before.q, run.before.v, run.simulator.state().q,
                                       run.simulator.state().v, run.simulator.input(), workspace,
                                       inverse, d_inverse, forward));
  return sensor_response(derivatives_of(run), forward);
}

/// A point mass of 1 kg `length` below a joint about y, with a spring along the joint's angle.
Scene pendulum(double length) {
  RobotSpec robot = test::make_arm();
  robot.links.pop_back();
  robot.joints.pop_back();
  robot.links[1].inertia = {1.0, Vector3(0, 0, -length), Matrix3::Zero()};
  robot.joints[0].axis = Vector3::UnitY();
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(robot, Base::kFixed, Pose());
  TendonSpec spring;
  spring.name = "spring";
  spring.joints = {{robot.joints[0].name, 0.5}};
  spring.stiffness = 30.0;
  spring.damping = 2.0;
  builder.add_tendon(spring);
  builder.add_sensor(imu("bob", "upper", {0, 0, -length}));
  SensorSpec force = sensor("force", {SensorKind::kTendonForce}, "");
  force.tendon = "spring";
  builder.add_sensor(force);
  Scene scene = scene_of(builder.build());
  scene.q[0] = 1.0;
  scene.v[0] = -2.0;
  return scene;
}

TEST(SensorDerivatives, OfAPendulumAreTheClosedForms) {
  const double length = 0.7;
  Sensed run(pendulum(length));
  run.step();
  const double q = run.before.q[0], w = run.before.v[0], h = run.simulator.options().time_step;
  const SensorDerivatives d = derivatives_of(run);
  const auto expect = [&](const char* column, double by_q, double by_v, double by_next) {
    const int row = run.index(column);
    const double scale = std::max({1.0, std::abs(by_q), std::abs(by_v), std::abs(by_next)});
    EXPECT_NEAR(d.dq(row, 0), by_q, kDerivative * scale) << column;
    EXPECT_NEAR(d.dv(row, 0), by_v, kDerivative * scale) << column;
    EXPECT_NEAR(d.dv_next(row, 0), by_next, kDerivative * scale) << column;
  };
  // ax = -(w+ - w) L / h - g sin q, az = w^2 L + g cos q
  expect("bob.ax", -kGravity * std::cos(q), length / h, -length / h);
  expect("bob.az", -kGravity * std::sin(q), 2.0 * w * length, 0.0);
  expect("bob.wy", 0.0, 1.0, 0.0);
  // force = -(k (L + h y - L0) + d y), y = 0.5 w+
  expect("force.force", -30.0 * 0.5, 0.0, -(30.0 * h + 2.0) * 0.5);
}

/// An accelerometer on a point mass feels, along its path, the applied torque and no more: with
/// the effects of tendons off its derivatives by the state vanish, and by the torque they are
/// -1 / (m L).
TEST(SensorDerivatives, ThroughAStepAnAccelerometerFeelsTheTorqueAlone) {
  const double length = 0.7;
  Scene scene = pendulum(length);
  scene.options.effects.set(Effect::kTendons, false);
  Sensed run(std::move(scene));
  run.step();
  const SensorResponse r = response_of(run);
  const int row = run.index("bob.ax");
  const double scale = length / run.simulator.options().time_step;  // size of terms that cancel
  EXPECT_NEAR(r.dq(row, 0), 0.0, kDerivative * scale);
  EXPECT_NEAR(r.dv(row, 0), 0.0, kDerivative * scale);
  EXPECT_NEAR(r.du(row, 0), -1.0 / length, kDerivative * scale);
}

/// The contact force of a box at rest, by the force and torque applied to it: against differences of
/// whole steps whose solver ends at rounding.
TEST(SensorDerivatives, OfContactForcesAgreeWithWholeSteps) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  Pose start;
  start.translation.z() = 0.05;
  builder.add_robot(object_of("box", {ShapeType::kBox, {0.1, 0.2, 0.05}, nullptr}, 2.0),
                    Base::kFloating, start);
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  builder.add_sensor(sensor("floor", {SensorKind::kContactForce}, "body"));
  builder.add_sensor(sensor("press", {SensorKind::kTouch}, "body"));
  Sensed run(scene_of(builder.build()));
  run.simulator.settings().tolerance = 1e-15;
  for (int i = 0; i < 200; ++i) run.step();
  const State rest = run.simulator.state();
  const auto values = [&](int coordinate, double force) {
    run.simulator.set_state(rest);
    run.simulator.input().applied_force = VectorX::Zero(6);
    run.simulator.input().applied_force[coordinate] = force;
    run.step();
    return run.values;
  };
  values(0, 0.0);
  const SensorResponse r = response_of(run);
  constexpr double kForce = 1e-2;      // change of the applied force [N, N m]
  constexpr double kWholeStep = 1e-5;  // rounding of forces over kForce, and its square over 20 N
  for (int k = 0; k < 6; ++k) {
    const VectorX expected = (values(k, kForce) - values(k, -kForce)) / (2.0 * kForce);
    EXPECT_LE((r.du.col(k) - expected).cwiseAbs().maxCoeff(), kWholeStep) << k;
  }
  // All that pushes down is carried.
  EXPECT_NEAR(r.du(3, 2), -1.0, 1e-3);
}

}  // namespace
}  // namespace counterpoint::sensor_derivatives_test
