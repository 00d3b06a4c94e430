// Values of sensors against answers by hand, and against the functions of Dynamics.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "engine/sensors/sensed.h"
#include "support/allocation_guard.h"
#include "support/arm_spec.h"
#include "support/random_model.h"

namespace counterpoint::sensor_values_test {
namespace {

using test::imu;
using test::Sensed;
using test::sensor;

constexpr double kGravity = 9.81;  // [m/s^2]
/// Rounding of sums of a few terms of up to 100.
constexpr double kRoundoff = 1e-12;
/// Rounding of (w+ - w) / h for steps of 1 ms and more and speeds of up to 10 m/s.
constexpr double kAcceleration = 1e-11;

/// A pendulum about the y axis with its point mass [kg] L below the joint, and `sensors` on it.
Scene pendulum(double length, const std::vector<SensorSpec>& sensors) {
  RobotSpec robot = test::make_arm();
  robot.links.pop_back();
  robot.joints.pop_back();
  robot.links[1].inertia = {1.0, Vector3(0, 0, -length), Matrix3::Zero()};
  robot.joints[0].axis = Vector3::UnitY();
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(robot, Base::kFixed, Pose());
  for (const SensorSpec& one : sensors) builder.add_sensor(one);
  return scene_of(builder.build());
}

Scene flying_box(const std::vector<SensorSpec>& sensors, bool ground = false) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  Pose start;
  start.translation.z() = 0.1;
  builder.add_robot(object_of("box", {ShapeType::kBox, {0.3, 0.2, 0.1}, nullptr}, 2.0),
                    Base::kFloating, start);
  if (ground) builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  for (const SensorSpec& one : sensors) builder.add_sensor(one);
  return scene_of(builder.build());
}

TEST(SensorValues, AccelerometerOfASwingingPendulumReadsTheDiscreteMotionToRoundOff) {
  const double length = 0.7;
  Scene scene = pendulum(length, {imu("bob", "upper", {0, 0, -length})});
  scene.options.time_step = 0.01;
  scene.q[0] = 1.0;
  scene.v[0] = -2.0;
  Sensed run(std::move(scene));
  for (int i = 0; i < 200; ++i) {
    run.step();
    const double q = run.before.q[0], w = run.before.v[0];
    const double a = (run.simulator.state().v[0] - w) / 0.01;
    const Vector3 expected(-a * length - kGravity * std::sin(q), 0.0,
                           w * w * length + kGravity * std::cos(q));
    EXPECT_LE((run.vector("bob.ax") - expected).norm(), kAcceleration) << i;
    EXPECT_LE((run.vector("bob.wx") - Vector3(0, w, 0)).norm(), kRoundoff) << i;
  }
}

TEST(SensorValues, AccelerometerOfASwingingPendulumTendsToTheTensionOfTheRod) {
  // The rod pulls along itself with m (g cos q + L w^2); with q(t) of a fine solution the error of
  // semi-implicit Euler falls with h.
  const double length = 0.7, end = 1.0;
  std::vector<double> tension;
  for (const double h : {1e-2, 1e-3, 1e-5}) {
    Scene scene = pendulum(length, {imu("bob", "upper", {0, 0, -length})});
    scene.options.time_step = h;
    scene.q[0] = 1.0;
    Sensed run(std::move(scene));
    while (run.simulator.state().time < end - 0.5 * h) run.step();
    tension.push_back(run.value("bob.az"));
    EXPECT_NEAR(run.value("bob.ax"), 0.0, 1e-9);  // rounding of (w+ - w) / h at 1e-5 s
  }
  const double coarse = std::abs(tension[0] - tension[2]), fine = std::abs(tension[1] - tension[2]);
  EXPECT_LT(coarse, 0.5);
  EXPECT_LT(fine, 0.15 * coarse);
}

TEST(SensorValues, AFallingImuReadsNoSpecificForce) {
  Scene scene = flying_box({imu("imu", "body")});
  scene.v << 1.0, -2.0, 3.0, 4.0, -5.0, 6.0;
  Sensed run(std::move(scene));
  for (int i = 0; i < 100; ++i) {
    run.step();
    EXPECT_LE(run.vector("imu.ax").norm(), kRoundoff * 1e2) << i;  // 10 m/s over 2 ms
    EXPECT_LE((run.vector("imu.wx") - run.before.v.tail<3>()).norm(), kRoundoff) << i;
  }
}

TEST(SensorValues, ARotatingImuReadsOmegaSquaredR) {
  const double omega = 5.0, r = 0.3;
  RobotSpec robot = test::make_arm();
  robot.links.pop_back();
  robot.joints.pop_back();
  robot.joints[0].axis = Vector3::UnitZ();
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(robot, Base::kFixed, Pose());
  SensorSpec turned = imu("imu", "upper", {r, 0, 0});
  turned.sensor.X_FS.rotation = rotation_from_rpy(0, 0, M_PI_2);  // x of the sensor along y
  builder.add_sensor(turned);
  Scene scene = scene_of(builder.build());
  scene.v[0] = omega;
  Sensed run(std::move(scene));
  for (int i = 0; i < 100; ++i) {
    run.step();
    const Vector3 expected(0.0, omega * omega * r, kGravity);
    EXPECT_LE((run.vector("imu.ax") - expected).norm(), kRoundoff) << i;
    EXPECT_NEAR(run.value("imu.wz"), omega, kRoundoff);
  }
}

TEST(SensorValues, ContactForcesAreMassTimesAccelerationLessGravity) {
  SensorSpec all = sensor("all", {SensorKind::kContactForce}, "body");
  SensorSpec pair = sensor("pair", {SensorKind::kContactForce}, "body");
  pair.from = "ground";
  SensorSpec own = sensor("own", {SensorKind::kContactForce}, "body");
  own.sensor.own_axes = true;
  Scene scene =
      flying_box({all, pair, own, sensor("ground", {SensorKind::kContactForce}, "ground")}, true);
  scene.v << 0.5, 0, 0, 0, 0, 0.4;
  Sensed run(std::move(scene));
  const double mass = 2.0, h = run.simulator.options().time_step;
  const double weight = mass * kGravity;
  for (int i = 0; i < 500; ++i) {
    run.step();
    const Vector3 a = (run.simulator.state().v.head<3>() - run.before.v.head<3>()) / h;
    const Vector3 expected = mass * (a + Vector3(0, 0, kGravity));
    const double tolerance = 1e-9 * (weight + expected.norm());  // the inverse's
    EXPECT_LE((run.vector("all.fx") - expected).norm(), tolerance) << i;
    EXPECT_EQ(run.vector("pair.fx"), run.vector("all.fx"));
    EXPECT_EQ(run.vector("ground.fx"), -run.vector("all.fx"));
    const Quaternion x(run.before.q[3], run.before.q[4], run.before.q[5], run.before.q[6]);
    EXPECT_LE((x * run.vector("own.fx") - run.vector("all.fx")).norm(), kRoundoff * weight) << i;
  }
  EXPECT_NEAR(run.value("all.fz"), weight, 1e-6 * weight);  // it has come to rest
}

TEST(SensorValues, VelocitiesAndAccelerationsAreDerivativesOfRelativePoses) {
  using enum SensorKind;
  for (int seed = 0; seed < 12; ++seed) {
    test::Random random(static_cast<std::uint64_t>(seed));
    const RobotSpec robot = test::make_random_robot(static_cast<std::uint64_t>(seed));
    ModelBuilder builder;
    builder.add_robot(robot, Base::kFloating, Pose());
    const std::string link = robot.links.back().name, other = robot.links[2].name;
    SensorSpec relative =
        sensor("relative", {kPosition, kOrientation, kLinearVelocity, kAngularVelocity}, link);
    relative.sensor.X_FS = test::random_pose(random, 0.3);
    SensorSpec moving = relative;
    relative.relative_to = other;
    moving.sensor.name = "moving";
    moving.sensor.kinds = {kLinearVelocity, kAngularVelocity, kLinearAcceleration,
                           kAngularAcceleration};
    builder.add_sensor(relative);
    builder.add_sensor(moving);
    const Model model = builder.build();
    const VectorX q = test::random_configuration(model, static_cast<std::uint64_t>(seed));
    const VectorX v = test::random_vector(model.nv(), 100 + static_cast<std::uint64_t>(seed));
    const VectorX a = test::random_vector(model.nv(), 200 + static_cast<std::uint64_t>(seed));
    // Central differences along q (+) (t v + t^2 a / 2), of error t^2 and rounding 1e-16 / t. The
    // second order of joints with several coordinates is that of their velocities in v.
    const double t = 1e-5, tolerance = 1e-7;
    SensorTable table(model, {});
    const Input none;
    const auto at = [&](double time) {
      VectorX moved(model.nq()), speed = v + time * a, next = speed + 1e-3 * a;
      integrate_configuration(model, q, v + 0.5 * time * a, time, moved);
      VectorX values(table.size());
      table.evaluate({moved, speed, moved, next, none, 1e-3}, values);
      return values;
    };
    const VectorX early = at(-t), now = at(0.0), late = at(t);
    const VectorX rate = (late - early) / (2.0 * t);
    // relative: x y z, qw qx qy qz, vx vy vz, wx wy wz; moving: vx vy vz, wx wy wz, ax ay az, ...
    EXPECT_LE((rate.head<3>() - now.segment<3>(7)).norm(), tolerance * (1.0 + now.norm())) << seed;
    const auto orientation = [](const VectorX& x) { return Quaternion(x[3], x[4], x[5], x[6]); };
    const Vector3 turned = quaternion_log(orientation(late) * orientation(early).inverse());
    EXPECT_LE((turned / (2.0 * t) - now.segment<3>(10)).norm(), tolerance * (1.0 + now.norm()))
        << seed;
    EXPECT_LE((rate.segment<6>(13) - now.segment<6>(19)).norm(), tolerance * (1.0 + now.norm()))
        << seed;
  }
}

TEST(SensorValues, MomentaOfTheSceneAndOfItsPartsAddUp) {
  using enum SensorKind;
  const std::vector<SensorKind> kinds = {kCenterOfMass, kCenterOfMassVelocity, kLinearMomentum,
                                         kAngularMomentum};
  for (int seed = 0; seed < 8; ++seed) {
    test::Random random(static_cast<std::uint64_t>(seed));
    ModelBuilder builder;
    for (const char* prefix : {"a/", "b/"})
      builder.add_robot(test::make_random_robot(static_cast<std::uint64_t>(seed)), Base::kFloating,
                        Pose(), prefix);
    builder.add_sensor(sensor("all", kinds, ""));
    const RobotSpec robot = test::make_random_robot(static_cast<std::uint64_t>(seed));
    builder.add_sensor(sensor("a", kinds, "a/" + robot.links.front().name));
    builder.add_sensor(sensor("b", kinds, "b/" + robot.links.front().name));
    Scene scene = scene_of(builder.build());
    scene.q = test::random_configuration(scene.model, static_cast<std::uint64_t>(seed));
    scene.v = test::random_vector(scene.model.nv(), static_cast<std::uint64_t>(seed));
    Dynamics dynamics(scene.model);
    dynamics.set_state(scene.q, scene.v);
    const Force momentum = dynamics.momentum();
    const Vector3 center = dynamics.center_of_mass();
    const double mass = dynamics.total_mass();
    Sensed run(std::move(scene));
    run.step();
    const double scale = kRoundoff * (1.0 + momentum.force.norm() + momentum.torque.norm());
    EXPECT_LE((run.vector("all.x") - center).norm(), kRoundoff) << seed;
    EXPECT_LE((run.vector("all.px") - momentum.force).norm(), scale) << seed;
    EXPECT_LE((run.vector("all.px") - mass * run.vector("all.vx")).norm(), scale);
    EXPECT_LE((run.vector("all.lx") + center.cross(momentum.force) - momentum.torque).norm(), scale)
        << seed;
    EXPECT_LE((run.vector("a.px") + run.vector("b.px") - run.vector("all.px")).norm(), scale);
  }
}

TEST(SensorValues, JointsReadTheirCoordinatesAndTheForceOfMotorAndServo) {
  using enum SensorKind;
  RobotSpec robot = test::make_arm();
  robot.joints[1].servo = {200.0, 5.0, 0.3, 0.0};
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFloating, Pose());
  SensorSpec elbow;
  elbow.sensor.name = "elbow";
  elbow.sensor.kinds = {kJointPosition, kJointVelocity, kJointEffort};
  elbow.joint = "elbow";
  SensorSpec base = elbow;
  base.sensor.name = base.joint = "base";
  builder.add_sensor(elbow);
  builder.add_sensor(base);
  Sensed run(scene_of(builder.build()));
  const double applied = 0.7;
  run.simulator.input().applied_force[7] = applied;
  for (int i = 0; i < 20; ++i) {
    run.step();
    EXPECT_EQ(run.value("elbow.q"), run.before.q[8]);
    EXPECT_EQ(run.value("elbow.v"), run.before.v[7]);
    // The servo acts at the end of the step: kp (target - q+) - kd w+.
    const State& after = run.simulator.state();
    const double servo = 200.0 * (0.3 - after.q[8]) - 5.0 * after.v[7];
    EXPECT_NEAR(run.value("elbow.u"), applied + servo, 1e-8);  // 1e-9 of 60 N m
    EXPECT_EQ(run.values.segment(run.index("base.x"), 7), run.before.q.head(7));
    EXPECT_LE(run.values.segment(run.index("base.fx"), 6).norm(), 1e-8);  // nothing drives it
  }
}

TEST(SensorValues, OnlyQuantitiesThatASensorNeedsAreComputed) {
  using enum SensorKind;
  const auto work = [](const std::vector<SensorSpec>& sensors) {
    Sensed run(pendulum(0.5, sensors));
    for (int i = 0; i < 3; ++i) run.step();
    return run.table.work();
  };
  EXPECT_EQ(work({}), SensorWork{});
  SensorSpec position;
  position.sensor.name = "q";
  position.sensor.kinds = {kJointPosition};
  position.joint = "shoulder";
  EXPECT_EQ(work({position}), SensorWork{});
  EXPECT_EQ(work({sensor("p", {kPosition}, "upper")}), (SensorWork{.poses = 3}));
  EXPECT_EQ(work({imu("i", "upper")}), (SensorWork{.poses = 3, .accelerations = 3}));
  EXPECT_EQ(work({sensor("r", {kRange}, "upper")}), (SensorWork{.poses = 3, .rays = 3}));
  EXPECT_EQ(work({test::wrench("w", "upper")}),
            (SensorWork{.poses = 3, .accelerations = 3, .inverses = 3, .wrenches = 3}));
}

TEST(SensorValues, AllocateNothingAfterTheFirstSteps) {
  using enum SensorKind;
  if (!test::counts_allocations()) GTEST_SKIP() << "allocations are not counted here";
  SensorSpec slow = imu("slow", "body");
  slow.sensor.errors = {{0.1}, {0.2}, {0.01}, 100.0, 0.02};
  Sensed run(flying_box(
      {imu("imu", "body"), sensor("r", {kRange}, "body"), slow, test::wrench("w", "body"),
       sensor("f", {kContactForce}, "body"), sensor("m", {kCenterOfMass, kAngularMomentum}, "")},
      true));
  SensorSampler readings(run.simulator.model(), 1);
  VectorX row(run.table.size());
  std::size_t count = 0;
  for (int i = 0; i < 300; ++i) {
    run.before = run.simulator.state();
    ASSERT_TRUE(run.simulator.step().succeeded());
    const State& after = run.simulator.state();
    run.values.resize(run.table.size());
    if (i == 150) count = test::allocation_count();
    run.table.evaluate({run.before.q, run.before.v, after.q, after.v, run.simulator.input(),
                        run.simulator.options().time_step},
                       run.values);
    readings.read(run.before.time, run.values, row);
    if (i == 150) {
      EXPECT_EQ(test::allocation_count(), count);
    }
  }
}

}  // namespace
}  // namespace counterpoint::sensor_values_test
