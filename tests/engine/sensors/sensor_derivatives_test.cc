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
/// Errors that the header states, relative to the largest term: without rows of constraints, and
/// with them (those of a spring are linear, and leave rounding over the short differences).
constexpr double kSmooth = 1e-9, kConstrained = 1e-6;

SensorDerivatives derivatives_of(Sensed& run) {
  Workspace workspace(run.simulator.model());
  SensorDerivatives d;
  sensor_derivatives(run.simulator.model(), run.simulator.options(), run.before,
                     run.simulator.input(), workspace, run.table, d);
  return d;
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

/// The step of a pendulum with a spring along the tendon c q is linear in (w, u).
TEST(SensorDerivatives, OfAPendulumAreTheClosedForms) {
  const double length = 0.7, c = 0.5, k = 30.0, damping = 2.0;
  Sensed run(pendulum(length));
  run.step();
  const double q = run.before.q[0], w = run.before.v[0], h = run.simulator.options().time_step;
  const double inertia = length * length, gain = c * c * (h * k + damping);
  const double whole =
      inertia + h * gain;  // times w+: inertia w + h (u - g L sin q - c^2 k (q - q0))
  const double next_by_q = -h * (kGravity * length * std::cos(q) + c * c * k) / whole;
  const double next_by_v = inertia / whole, next_by_u = h / whole;
  const SensorDerivatives d = derivatives_of(run);
  const auto expect = [&](const char* column, double by_q, double by_v, double by_next) {
    const int row = run.index(column);
    const double scale = std::max({1.0, std::abs(by_q), std::abs(by_v), std::abs(by_next)});
    EXPECT_NEAR(d.dq(row, 0), by_q + by_next * next_by_q, kConstrained * scale) << column;
    EXPECT_NEAR(d.dv(row, 0), by_v + by_next * next_by_v, kConstrained * scale) << column;
    EXPECT_NEAR(d.du(row, 0), by_next * next_by_u, kConstrained * scale) << column;
  };
  // ax = -(w+ - w) L / h - g sin q, az = w^2 L + g cos q
  expect("bob.ax", -kGravity * std::cos(q), length / h, -length / h);
  expect("bob.az", -kGravity * std::sin(q), 2.0 * w * length, 0.0);
  expect("bob.wy", 0.0, 1.0, 0.0);
  // force = -(k (L_t + h y - L_0) + d y), y = c w+
  expect("force.force", -k * c, 0.0, -(k * h + damping) * c);
}

/// An accelerometer on a point mass feels, along its path, the applied torque and no more: without
/// the spring its derivatives by the state vanish, and that by the torque is -1 / (m L).
TEST(SensorDerivatives, AnAccelerometerOnAPointMassFeelsTheTorqueAlone) {
  const double length = 0.7;
  Scene scene = pendulum(length);
  scene.options.effects.set(Effect::kTendons, false);
  Sensed run(std::move(scene));
  run.step();
  const SensorDerivatives d = derivatives_of(run);
  const int row = run.index("bob.ax");
  const double scale = length / run.simulator.options().time_step;  // size of terms that cancel
  EXPECT_NEAR(d.dq(row, 0), 0.0, kSmooth * scale);
  EXPECT_NEAR(d.dv(row, 0), 0.0, kSmooth * scale);
  EXPECT_NEAR(d.du(row, 0), -1.0 / length, kSmooth * scale);
}

/// A box that rests on the ground passes on what pushes it: its force on the floor changes by the
/// applied force, and by the momentum that its velocity brings, m / h.
TEST(SensorDerivatives, ABoxAtRestPassesOnWhatPushesIt) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  Pose start;
  start.translation.z() = 0.05;
  builder.add_robot(object_of("box", {ShapeType::kBox, {0.1, 0.2, 0.05}, nullptr}, 2.0),
                    Base::kFloating, start);
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  builder.add_sensor(sensor("floor", {SensorKind::kContactForce}, "body"));
  builder.add_sensor(sensor("press", {SensorKind::kTouch}, "body"));
  Sensed run(scene_of(builder.build()));
  for (int i = 0; i < 500; ++i) run.step();
  const SensorDerivatives d = derivatives_of(run);
  constexpr double kAtContacts = 1e-5;  // stated by the header
  const double per_speed = 2.0 / run.simulator.options().time_step;
  for (int k = 0; k < 3; ++k) {
    Vector3 unit = Vector3::Unit(k);
    EXPECT_LE((d.du.col(k).head<3>() + unit).norm(), kAtContacts) << k;
    EXPECT_LE((d.dv.col(k).head<3>() + per_speed * unit).norm(), kAtContacts * per_speed) << k;
  }
  EXPECT_NEAR(d.du(3, 2), -1.0, kAtContacts);
  EXPECT_NEAR(d.du(3, 0), 0.0, kAtContacts);
}

}  // namespace
}  // namespace counterpoint::sensor_derivatives_test
