// Estimates from inertial units and markers on a simulated quadruped.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/estimate/sensors/sensor_terms.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::sensor_estimates_test {
namespace {

constexpr double kH = 0.01;  // interval of rows [s]

Sensor sensor_on(SensorKind kind, int body, const Vector3& point = Vector3::Zero()) {
  Sensor sensor;
  sensor.name = "sensor";
  sensor.kind = kind;
  sensor.body = body;
  sensor.point = point;
  sensor.deviation = 1.0;
  return sensor;
}

/// A quadruped that drops under random torques; its states every 2 ms, from which sensors are
/// simulated.
struct Drop {
  explicit Drop(double seconds)
      : scene(load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml")) {
    scene.options.time_step = 0.002;
    Simulator simulator(scene);
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    VectorX& force = simulator.input().applied_force;
    force = VectorX::Zero(scene.model.nv());
    const int steps = static_cast<int>(seconds / scene.options.time_step);
    for (int step = 0; step <= steps; ++step) {
      time.push_back(simulator.state().time);
      q.push_back(simulator.state().q);
      v.push_back(simulator.state().v);
      for (int i = 6; i < scene.model.nv(); ++i) force[i] = 0.3 * normal(random);
      EXPECT_TRUE(simulator.step().succeeded());
    }
  }

  Recording recording(double noise) const {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    Recording out;
    out.file = "simulated";
    const int rows = static_cast<int>(time.size() - 1) / 5 + 1;
    out.q.resize(scene.model.nq(), rows);
    out.v = out.applied_force = MatrixX::Zero(scene.model.nv(), rows);
    VectorX by(scene.model.nv()), noisy(scene.model.nq());
    for (int row = 0; row < rows; ++row) {
      const auto at = static_cast<std::size_t>(5 * row);
      out.time.push_back(time[at]);
      for (double& x : by) x = noise * normal(random);
      integrate_configuration(scene.model, q[at], by, 1.0, noisy);
      out.q.col(row) = noisy;
    }
    return out;
  }

  /// Median error from 0.1 s on of the total vertical contact force, relative to the weight.
  double force_error(const MotionEstimate& estimate) const {
    Dynamics dynamics(scene.model);
    std::vector<double> height;
    for (std::size_t at = 0; at < q.size(); at += 5) {
      dynamics.set_configuration(q[at]);
      height.push_back(dynamics.center_of_mass().z());
    }
    double weight = 0.0;
    std::vector<double> errors;
    for (const Body& body : scene.model.bodies())
      weight += body.inertia.mass * scene.model.gravity().norm();
    for (std::size_t t = 10; t + 1 < estimate.time.size(); ++t) {
      const double truth = 1.0 + (height[t + 1] - 2.0 * height[t] + height[t - 1]) /
                                     (kH * kH * scene.model.gravity().norm());
      errors.push_back(
          std::abs(estimate.sum_force(2, static_cast<Eigen::Index>(t)) / weight - truth));
    }
    return median(errors);
  }

  MotionEstimateOptions options() const {
    MotionEstimateOptions out;
    ContactSum all{"all", {}};
    for (int b = 1; b < scene.model.num_bodies(); ++b) all.bodies.push_back(b);
    out.sums.push_back(all);
    out.errors = RecordingErrors::kWhite;
    return out;
  }

  Scene scene;
  std::vector<double> time;
  std::vector<VectorX> q, v;
};

/// Adds an inertial unit at the trunk's origin with noise, a clock delay and a gyroscope offset.
void add_inertial_unit(const Drop& drop, double late, const Vector3& offset, ColumnMap& map,
                       Recording& recording) {
  SensorSource& source = map.sources.emplace_back();
  source.name = "imu";
  source.delay_deviation = 0.05;
  Sensor gyro = sensor_on(SensorKind::kAngularVelocity, 1);
  gyro.name = "gyro";
  gyro.deviation = 0.01;
  gyro.has_offset = true;
  gyro.source = "imu";
  Sensor accelerometer = sensor_on(SensorKind::kSpecificForce, 1);
  accelerometer.name = "accelerometer";
  accelerometer.deviation = 0.2;
  accelerometer.source = "imu";
  map.sensors = {gyro, accelerometer};
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto n = static_cast<Eigen::Index>(drop.time.size()) - 1;
  recording.sensors.assign(2, {{}, MatrixX(3, n)});
  const double h = drop.scene.options.time_step;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const VectorX& q = drop.q[i];
    const Quaternion R(q[3], q[4], q[5], q[6]);
    const Vector3 a = (drop.v[i + 1] - drop.v[i]).head<3>() / h - drop.scene.model.gravity();
    for (int axis = 0; axis < 3; ++axis) {
      recording.sensors[0].values(axis, k) =
          drop.v[i + 1][3 + axis] + offset[axis] + 0.01 * normal(random);
      recording.sensors[1].values(axis, k) = (R.conjugate() * a)[axis] + 0.2 * normal(random);
    }
    // Both readings are means over the step that begins at drop.time.
    for (SensorReadings& one : recording.sensors) one.time.push_back(drop.time[i] + 0.5 * h + late);
  }
}

TEST(Sensors, ReadingsOfASimulationAgreeWithItsFrames) {
  const Drop drop(0.9);
  ColumnMap map = test::all_positions(drop.scene.model);
  Recording recording = drop.recording(0.0);
  constexpr double kLate = 0.006;
  const Vector3 offset(0.03, -0.02, 0.05);
  add_inertial_unit(drop, kLate, offset, map, recording);
  const SensorTerms sensors = sensor_terms(drop.scene.model, map, recording, kH);
  std::vector<VectorX> frames;
  for (int row = 0; row < recording.num_rows(); ++row) frames.push_back(recording.q.col(row));
  VectorX constants(4);
  constants << offset, kLate;
  SensorRows rows(drop.scene.model, sensors.terms, 4);
  std::vector<double> sizes;
  for (int t = 2; t + 3 < recording.num_rows(); ++t) {
    rows.evaluate(drop.scene.model, {frames, constants, 0.0, kH}, t, false);
    for (int k = 0; k < rows.of_motion().size; ++k)
      sizes.push_back(std::abs(rows.of_motion().residual[k]));
  }
  // The median of a normal distribution is 0.67 deviations. Impacts shorter than the 2 ms between
  // readings deviate far more, but do not affect the median.
  EXPECT_NEAR(median(sizes), 0.67, 0.3);
}

TEST(Sensors, AnInertialUnitHelpsAndItsClockAndOffsetAreFound) {
  const Drop drop(0.9);
  ColumnMap map = test::all_positions(drop.scene.model);
  Recording recording = drop.recording(1e-3);
  const double alone =
      drop.force_error(estimate_motion(drop.scene, map, recording, drop.options()));
  constexpr double kLate = 0.006;
  const Vector3 offset(0.03, -0.02, 0.05);
  add_inertial_unit(drop, kLate, offset, map, recording);
  const MotionEstimate found = estimate_motion(drop.scene, map, recording, drop.options());
  ASSERT_EQ(found.parameters.size(), 4u);
  EXPECT_EQ(found.parameters[3].name, "delay:imu");
  EXPECT_NEAR(found.parameters[3].value, kLate, 1e-3)
      << "a tenth of an interval: readings do not resolve the impacts that tell it";
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(found.parameters[static_cast<std::size_t>(axis)].value, offset[axis], 0.01)
        << "the deviation of one reading, " << axis;
  EXPECT_LE(drop.force_error(found), alone) << "more is known";
  ASSERT_EQ(found.sensors.size(), 2u);
  for (const SensorMetrics& one : found.sensors) {
    EXPECT_GT(one.rows, 80);
    EXPECT_LE(one.outliers, one.rows / 4)
        << one.name << ": at impacts, which are shorter than a row";
  }
}

/// Place of an inertial unit in a body: position [m] and rotation vector [rad], and the factor of
/// its angular velocities.
struct UnitPlace {
  Vector3 position, rotation;
  double scale = 1.0;
};

constexpr int kUnitSubsteps = 10;  // readings of the unit per row

/// Simulates a second of a free body: 100 rows with noise of 0.1 mm and 0.1 mrad, and 1000 readings
/// of an inertial unit with noise of 0.03 rad/s and 0.15 m/s^2.
Recording tumble(const Scene& scene, const UnitPlace& place) {
  constexpr int kRows = 100;
  const Matrix3 to_unit = quaternion_exp(place.rotation).toRotationMatrix().transpose();
  const double h = scene.options.time_step;
  Simulator simulator(scene);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  Recording out;
  out.file = "simulated";
  out.q.resize(scene.model.nq(), kRows);
  out.v = out.applied_force = MatrixX::Zero(scene.model.nv(), kRows);
  out.sensors.assign(2, {{}, MatrixX(3, kRows * kUnitSubsteps)});
  for (int step = 0; step < kRows * kUnitSubsteps; ++step) {
    const State before = simulator.state();
    EXPECT_TRUE(simulator.step().succeeded());
    const State& after = simulator.state();
    if (step % kUnitSubsteps == 0) {
      out.time.push_back(before.time);
      VectorX by(6), noisy(7);
      for (double& x : by) x = 1e-4 * normal(random);
      integrate_configuration(scene.model, before.q, by, 1.0, noisy);
      out.q.col(step / kUnitSubsteps) = noisy;
    }
    const VectorX rate = (after.v - before.v) / h;
    const Quaternion R(before.q[3], before.q[4], before.q[5], before.q[6]);
    const Vector3 w = after.v.tail<3>(), alpha = rate.tail<3>();
    const Vector3 felt = R.conjugate() * Vector3(rate.head<3>() - scene.model.gravity()) +
                         alpha.cross(place.position) + w.cross(w.cross(place.position));
    const Vector3 turning = place.scale * to_unit * w, pushed = to_unit * felt;
    for (int axis = 0; axis < 3; ++axis) {
      out.sensors[0].values(axis, step) = turning[axis] + 0.03 * normal(random);
      out.sensors[1].values(axis, step) = pushed[axis] + 0.15 * normal(random);
    }
    for (SensorReadings& one : out.sensors) one.time.push_back(before.time + 0.5 * h);
  }
  return out;
}

// The box tumbles at about 7 rad/s. A thousand readings with noise of 0.03 rad/s leave the rotation
// of the axes and the factor uncertain by 0.03 / 7 / 30 = 0.15e-3; 0.15 m/s^2 over 49 m/s^2 a metre
// leave the place uncertain by 0.1 mm. Tolerances are five times of it.
TEST(Sensors, ThePlacementAndScaleOfAnInertialUnitAreFound) {
  // With equal moments the box would turn about one axis, about which nothing tells the rotation.
  Scene scene = test::box_on_plane({.half = {0.05, 0.1, 0.2}, .ground = false});
  scene.q[2] = 8.0;
  scene.v << 0.3, 0.1, 2.0, 5.0, 3.0, -4.0;
  scene.options.time_step = 0.001;
  const UnitPlace place{{0.03, -0.02, 0.04}, {0.04, -0.06, 0.05}, 1.03};
  const Recording recording = tumble(scene, place);
  ColumnMap map = test::all_positions(scene.model);
  for (const SensorKind kind : {SensorKind::kAngularVelocity, SensorKind::kSpecificForce}) {
    Sensor& sensor = map.sensors.emplace_back(sensor_on(kind, 1));
    sensor.name = "unit";
    sensor.deviation = kind == SensorKind::kAngularVelocity ? 0.03 : 0.15;
    sensor.has_placement = true;
    sensor.has_scale = kind == SensorKind::kAngularVelocity;
  }
  MotionEstimateOptions options;
  options.errors = RecordingErrors::kWhite;
  const MotionEstimate found = estimate_motion(scene, map, recording, options);
  std::map<std::string, double> values;
  for (const EstimatedParameter& one : found.parameters) values[one.name] = one.value;
  ASSERT_EQ(values.size(), 7u) << "both parts share a rotation";
  for (int axis = 0; axis < 3; ++axis) {
    const std::string letter(1, "xyz"[axis]);
    EXPECT_NEAR(values.at("rotation:unit." + letter), place.rotation[axis], 0.75e-3);
    EXPECT_NEAR(values.at("position:unit." + letter), place.position[axis], 0.5e-3);
  }
  EXPECT_NEAR(1.0 + values.at("scale:unit.angular"), place.scale, 0.75e-3);
}

TEST(Sensors, MarkersTellTheMotionAlthoughSomeAreMissing) {
  const Drop drop(0.7);
  ColumnMap map;
  Recording recording = drop.recording(0.0);
  const Recording truth = recording;
  const int rows = recording.num_rows();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Dynamics dynamics(drop.scene.model);
  for (int body = 1; body < drop.scene.model.num_bodies(); ++body) {
    for (const Vector3& point : {Vector3(0.1, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, -0.15)}) {
      Sensor marker = sensor_on(SensorKind::kPoint, body, point);
      marker.name = "marker" + std::to_string(map.sensors.size());
      marker.deviation = 1e-3;
      map.sensors.push_back(marker);
      SensorReadings& readings = recording.sensors.emplace_back();
      readings.time = recording.time;
      readings.values.resize(3, rows);
    }
  }
  Data data(drop.scene.model);
  for (int row = 0; row < rows; ++row) {
    compute_poses(drop.scene.model, truth.q.col(row), data);
    for (std::size_t k = 0; k < map.sensors.size(); ++k) {
      Vector3 z = data.X_WB[static_cast<std::size_t>(map.sensors[k].body)] * map.sensors[k].point;
      for (double& x : z) x += 1e-3 * normal(random);
      if (uniform(random) < 0.15) z.setConstant(std::numeric_limits<double>::quiet_NaN());
      recording.sensors[k].values.col(row) = z;
    }
    recording.q.col(row) = drop.scene.q;  // only markers are recorded
  }
  const MotionEstimate found = estimate_motion(drop.scene, map, recording, drop.options());
  VectorX difference(drop.scene.model.nv());
  double squares = 0.0;
  for (int row = 0; row < rows; ++row) {
    configuration_difference(drop.scene.model, truth.q.col(row), found.q.col(row), difference);
    squares += difference.squaredNorm();
  }
  // Three markers 0.1 m from a joint's axis determine its angle to 1 mm / 0.1 m / sqrt(3) or
  // better.
  EXPECT_LE(std::sqrt(squares / (rows * drop.scene.model.nv())), 0.006);
  double kinematic = 0.0;
  for (int row = 0; row < rows; ++row) {
    configuration_difference(drop.scene.model, truth.q.col(row), found.recorded.col(row),
                             difference);
    kinematic += difference.squaredNorm();
  }
  EXPECT_LE(std::sqrt(kinematic / (rows * drop.scene.model.nv())), 0.006);
  EXPECT_LE(drop.force_error(found), 0.05) << "weights";
  EXPECT_NEAR(found.mean_cost_ratio, 1.0, 0.3);
}

}  // namespace
}  // namespace counterpoint::estimation::sensor_estimates_test
