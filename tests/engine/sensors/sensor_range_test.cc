// Distances along rays, in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/sensors/sensed.h"
#include "support/arm_spec.h"

namespace counterpoint::sensor_range_test {
namespace {

using test::Sensed;
using test::sensor;

/// Rounding of the ray's intersection with a shape some metres away [m].
constexpr double kRoundoff = 1e-12;

/// A shape on the world.
struct Thing {
  Shape shape;
  Pose X_WG;
};

Thing ground() { return {{ShapeType::kPlane, Vector3::Zero(), nullptr}, Pose()}; }

/// Reading of an eye at (0, 0, 2) m that looks down, turned by `angle` [rad] about y.
double range_at(double angle, const std::vector<Thing>& room,
                double limit = std::numeric_limits<double>::infinity()) {
  RobotSpec robot = test::make_arm();
  robot.links.pop_back();
  robot.joints.pop_back();
  robot.joints[0].axis = Vector3::UnitY();
  robot.links[1].collisions.push_back({"", Pose(), {ShapeType::kSphere, {0.2, 0, 0}, nullptr}, {}});
  ModelBuilder builder(Vector3::Zero());
  Pose up;
  up.translation.z() = 2.0;
  builder.add_robot(robot, Base::kFixed, up);
  int count = 0;
  for (const Thing& one : room)
    builder.add_environment("thing" + std::to_string(count++), one.shape, one.X_WG, {});
  SensorSpec range = sensor("eye", {SensorKind::kRange}, "upper");
  range.sensor.X_FS.rotation = rotation_z_to(-Vector3::UnitZ());
  range.sensor.limit = limit;
  builder.add_sensor(range);
  builder.set_default_position("shoulder", VectorX::Constant(1, angle));
  Sensed run(scene_of(builder.build()));
  run.step();
  EXPECT_EQ(run.values.size(), 1);
  return run.values[0];
}

TEST(SensorRange, MeetsThePlaneTheSphereAndTheBox) {
  const double angle = 0.4;
  EXPECT_NEAR(range_at(angle, {ground()}), 2.0 / std::cos(angle), kRoundoff);
  // A ball of radius 0.3 m, 1.5 m below: the nearer solution of a quadratic equation.
  const Thing ball{{ShapeType::kSphere, {0.3, 0, 0}, nullptr}, {Matrix3::Identity(), {0, 0, 0.5}}};
  const double small = 0.1, along = 1.5 * std::cos(small), off = 1.5 * std::sin(small);
  EXPECT_NEAR(range_at(small, {ground(), ball}), along - std::sqrt(0.09 - off * off), kRoundoff);
  EXPECT_NEAR(range_at(angle, {ground(), ball}), 2.0 / std::cos(angle), kRoundoff);  // beside it
  // A box turned by 45 degrees about y: its faces are along the ray at that angle.
  const double half = 0.25;
  const Thing box{{ShapeType::kBox, {half, half, half}, nullptr},
                  {rotation_from_rpy(0, M_PI / 4, 0), {-1, 0, 1}}};
  EXPECT_NEAR(range_at(M_PI / 4, {ground(), box}), std::sqrt(2.0) - half, kRoundoff);
}

TEST(SensorRange, BeyondTheLimitThereIsNoValue) {
  EXPECT_NEAR(range_at(0.0, {ground()}, 2.5), 2.0, kRoundoff);
  EXPECT_TRUE(std::isnan(range_at(0.0, {ground()}, 1.5)));
  EXPECT_TRUE(std::isnan(range_at(0.0, {})));  // its own ball is not seen
}

TEST(SensorRange, ASensorOnTheWorldSeesMovingBodies) {
  ModelBuilder builder(Vector3::Zero());
  Pose start;
  start.translation = {3.0, 0, 0};
  builder.add_robot(object_of("ball", {ShapeType::kSphere, {0.5, 0, 0}, nullptr}, 1.0),
                    Base::kFloating, start);
  SensorSpec gate = sensor("gate", {SensorKind::kRange}, "world");
  gate.sensor.X_FS.rotation = rotation_z_to(Vector3::UnitX());
  builder.add_sensor(gate);
  Scene scene = scene_of(builder.build());
  scene.v[0] = -1.0;
  Sensed run(std::move(scene));
  for (int i = 0; i < 10; ++i) {
    run.step();
    EXPECT_NEAR(run.values[0], run.before.q[0] - 0.5, kRoundoff);
  }
}

}  // namespace
}  // namespace counterpoint::sensor_range_test
