// Sensors of contacts, tendons and actuators against answers by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/sensors/sensed.h"
#include "support/arm_spec.h"
#include "support/small_scenes.h"

namespace counterpoint::sensor_parts_test {
namespace {

using test::make_joint;
using test::make_link;
using test::Sensed;
using test::sensor;
using test::wrench;

constexpr double kGravity = 9.81;  // [m/s^2]
/// Rounding of sums of a few terms of up to 10.
constexpr double kRoundoff = 1e-12;
/// The inverse agrees with the step to this part of the largest force.
constexpr double kInverse = 1e-9;

SensorSpec of_tendon(const std::string& name, SensorKind kind, const std::string& tendon) {
  SensorSpec spec = sensor(name, {kind}, "");
  spec.tendon = tendon;
  return spec;
}

SensorSpec of_actuator(const std::string& name, SensorKind kind, const std::string& actuator) {
  SensorSpec spec = sensor(name, {kind}, "");
  spec.actuator = actuator;
  return spec;
}

/// A box of 2 kg, 0.2 m by 0.4 m at its foot, that rests on the ground.
Scene resting_box(const std::vector<SensorSpec>& sensors) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  Pose start;
  start.translation.z() = 0.05;
  builder.add_robot(object_of("box", {ShapeType::kBox, {0.1, 0.2, 0.05}, nullptr}, 2.0),
                    Base::kFloating, start);
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  for (const SensorSpec& one : sensors) builder.add_sensor(one);
  return scene_of(builder.build());
}

TEST(SensorParts, TouchAndPressureShareTheWeightOfABoxAtRest) {
  const auto pad = [](const std::string& name, SensorKind kind, const Vector3& position,
                      const Vector3& size) {
    SensorSpec spec = sensor(name, {kind}, "body", position);
    spec.sensor.size = size;
    return spec;
  };
  const double kAll = std::numeric_limits<double>::infinity();
  Sensed run(resting_box({sensor("whole", {SensorKind::kTouch}, "body"),
                          pad("foot", SensorKind::kPressure, Vector3::Zero(), {0.3, 0.5, kAll}),
                          pad("half", SensorKind::kTouch, {0.1, 0, 0}, {0.1, 0.5, kAll}),
                          pad("high", SensorKind::kTouch, {0, 0, 0.05}, {1, 1, 0.05}),
                          sensor("force", {SensorKind::kContactForce}, "body")}));
  for (int i = 0; i < 1000; ++i) run.step();
  const double weight = 2.0 * kGravity;
  constexpr double kRest = 1e-7;  // speeds that are left after 2 s, over the step of 2 ms [m/s^2]
  EXPECT_NEAR(run.value("whole.touch"), weight, kRest * weight);
  // On a plane the normals are vertical: touch is the vertical force to round-off.
  EXPECT_NEAR(run.value("whole.touch"), run.value("force.fz"), kRoundoff * weight);
  EXPECT_NEAR(run.value("foot.pressure"), run.value("whole.touch") / (0.3 * 0.5),
              kRoundoff * weight / 0.15);
  // Two of the four corners lie under the half; none is near the upper side.
  EXPECT_NEAR(run.value("half.touch"), 0.5 * weight, kRest * weight);
  EXPECT_EQ(run.value("high.touch"), 0.0);
}

/// A turret of 3 kg turning about z, and on it an arm of 1 kg turning about y, with a spring and an
/// actuator along a cord from the turret to the end of the arm.
Scene tied_arm(const std::vector<SensorSpec>& sensors, double spin = 0.0, bool wrapped = false) {
  RobotSpec robot;
  robot.name = "arm";
  robot.links = {make_link("base", 1.0), make_link("turret", 3.0), make_link("upper", 1.0, 0.02),
                 make_link("tip", 0.0, 0.0)};
  robot.links[2].inertia.center = {0, 0, -0.25};
  robot.joints = {make_joint("pan", "base", "turret"), make_joint("shoulder", "turret", "upper"),
                  make_joint("glue", "upper", "tip")};
  robot.joints[2].fixed = true;
  robot.joints[0].axis = Vector3::UnitZ();
  robot.joints[1].axis = Vector3::UnitY();
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(robot, Base::kFixed, Pose());
  TendonSpec tendon;
  tendon.name = "cord";
  using Kind = TendonSpec::Place::Kind;
  const auto place = [&](Kind kind, const char* link, const Vector3& position, double radius) {
    TendonSpec::Place& out = tendon.path.emplace_back();
    out.kind = kind;
    out.link = link;
    out.X_LG.translation = position;
    out.radius = radius;
  };
  place(Kind::kPoint, "turret", {0.3, 0, 0.4}, 0.0);
  if (wrapped) place(Kind::kSphere, "upper", {0.15, 0, -0.1}, 0.1);
  place(Kind::kPoint, "upper", {0.05, 0, -0.5}, 0.0);
  tendon.stiffness = 40.0;
  tendon.damping = 3.0;
  tendon.rest = std::pair(0.4, 0.4);
  builder.add_tendon(tendon);
  Actuator pull;
  pull.name = "pull";
  pull.transmission = Transmission::kTendon;
  pull.gear = 2.0;
  pull.command = -1.5;
  builder.add_actuator({pull, "", "cord", "", ""});
  for (const SensorSpec& one : sensors) builder.add_sensor(one);
  Scene scene = scene_of(builder.build());
  scene.q << 0.0, 0.4;
  scene.v << spin, -2.0;
  return scene;
}

TEST(SensorParts, ATendonReadsTheLawOfItsLength) {
  using enum SensorKind;
  Sensed run(tied_arm(
      {of_tendon("l", kTendonLength, "cord"), of_tendon("s", kTendonVelocity, "cord"),
       of_tendon("f", kTendonForce, "cord"), of_actuator("x", kActuatorPosition, "pull"),
       of_actuator("y", kActuatorVelocity, "pull"), of_actuator("p", kActuatorForce, "pull")}));
  for (const SensorColumn& column : run.table.columns()) EXPECT_NE(column.unit, "") << column.name;
  for (int i = 0; i < 50; ++i) {
    run.step();
    const double angle = run.before.q[1], h = run.simulator.options().time_step;
    const Vector3 end = rotation_from_rpy(0, angle, 0) * Vector3(0.05, 0, -0.5);
    const Vector3 along = end - Vector3(0.3, 0, 0.4);
    const double length = along.norm(), arm = along.dot(Vector3::UnitY().cross(end)) / length;
    const double speed = arm * run.before.v[1], next = arm * run.simulator.state().v[1];
    EXPECT_NEAR(run.value("l.length"), length, kRoundoff);
    EXPECT_NEAR(run.value("s.speed"), speed, kRoundoff);
    EXPECT_NEAR(run.value("x.position"), 2.0 * length, kRoundoff);
    EXPECT_NEAR(run.value("y.speed"), 2.0 * speed, kRoundoff);
    EXPECT_NEAR(run.value("p.force"), -1.5, kRoundoff);
    const double spring = -40.0 * (length + h * next - 0.4) - 3.0 * next;
    EXPECT_NEAR(run.value("f.force"), spring - 2.0 * 1.5, kInverse * 40.0);
  }
}

/// Without applied forces the wrench through a joint has no component along its axis. A tendon
/// between two links does not act on both together: their sum has the force of gravity and inertia.
TEST(SensorParts, WrenchesCountThePullOfTendons) {
  for (const bool wrapped : {false, true}) {
    SensorSpec center =
        sensor("center", {SensorKind::kSpecificForce}, "upper", Vector3(0, 0, -0.25));
    Sensed run(tied_arm({wrench("shoulder", "upper"), wrench("pan", "turret"), center,
                         of_tendon("cord", SensorKind::kTendonForce, "cord")},
                        3.0, wrapped));
    for (int i = 0; i < 50; ++i) {
      run.step();
      EXPECT_GT(std::abs(run.value("cord.force")), 1.0);
      EXPECT_NEAR(run.value("shoulder.ty"), 0.0, kInverse * 40.0);
      EXPECT_NEAR(run.value("pan.tz"), 0.0, kInverse * 40.0);
      const Vector3 force = 1.0 * run.vector("center.ax") + Vector3(0, 0, 3.0 * kGravity);
      const Matrix3 to_turret = rotation_from_rpy(0, 0, run.before.q[0]).transpose();
      EXPECT_LE((run.vector("pan.fx") - to_turret * force).norm(), kInverse * 60.0) << wrapped << i;
    }
  }
}

TEST(SensorParts, PartsThatHaveNoSuchValueAreNamed) {
  const auto expect_error = [](const SensorSpec& spec, const std::string& words) {
    try {
      tied_arm({spec});
      ADD_FAILURE() << "accepted; expected an error that names " << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  expect_error(of_tendon("a", SensorKind::kTendonForce, "rope"), "tendons: 'cord'");
  expect_error(of_actuator("a", SensorKind::kActuatorForce, "rope"), "actuators: 'pull'");
  expect_error(sensor("a", {SensorKind::kPressure}, "upper"), "needs size");
  SensorSpec mixed = of_tendon("a", SensorKind::kTendonForce, "cord");
  mixed.sensor.kinds.push_back(SensorKind::kActuatorForce);
  expect_error(mixed, "do not mix");
  expect_error(wrench("a", "tip"), "a tendon acts on them");
}

}  // namespace
}  // namespace counterpoint::sensor_parts_test
