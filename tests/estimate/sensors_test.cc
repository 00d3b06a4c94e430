// Sensors of a recording: what they read of known motions, how their residuals go with the frames,
// and what an estimate makes of them.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/estimate/sensors/pose_fit.h"
#include "counterpoint/engine/estimate/sensors/sensor_terms.h"
#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::sensors_test {
namespace {

constexpr double kRate = 100.0, kH = 1.0 / kRate;

Sensor sensor_on(SensorKind kind, int body, const Vector3& point = Vector3::Zero()) {
  Sensor sensor;
  sensor.name = "sensor";
  sensor.kind = kind;
  sensor.body = body;
  sensor.point = point;
  sensor.deviation = 1.0;
  return sensor;
}

/// Readings from -0.1 s on at a rate [Hz], each as `at` (time) says.
template <class At>
SensorReadings readings_of(SensorKind kind, double rate, int rows, At at) {
  SensorReadings out;
  out.values.resize(reading_size(kind), rows);
  for (int row = 0; row < rows; ++row) {
    out.time.push_back(-0.1 + row / rate);
    out.values.col(row) = at(out.time.back());
  }
  return out;
}

SensorTerm term_of(const Sensor& sensor, const SensorReadings& readings) {
  SensorTerm term{.sensor = sensor, .signal = SensorSignal(sensor, readings, kH)};
  term.weight = 1.0;
  return term;
}

/// A box that falls freely and turns about its vertical axis at `spin` [rad/s].
std::vector<VectorX> spinning_fall(const Scene& scene, double spin, int rows) {
  std::vector<VectorX> out;
  for (int row = 0; row < rows; ++row) {
    const double t = row * kH;
    VectorX q = scene.q;
    q.head<3>() = Vector3(0.3 * t, 0.0, 5.0) + 0.5 * t * t * scene.model.gravity();
    q.segment<4>(3) << std::cos(0.5 * spin * t), 0.0, 0.0, std::sin(0.5 * spin * t);
    out.push_back(q);
  }
  return out;
}

TEST(Sensors, ReadWhatAFallingSpinningBoxFeels) {
  const Scene scene = test::box_on_plane({.ground = false});
  constexpr double kSpin = 3.0, kReach = 0.2;
  const std::vector<VectorX> frames = spinning_fall(scene, kSpin, 3);
  const auto nothing = [](double) { return Vector3::Zero().eval(); };
  const Sensor gyro = sensor_on(SensorKind::kAngularVelocity, 1);
  const Sensor centre = sensor_on(SensorKind::kSpecificForce, 1);
  Sensor rim = sensor_on(SensorKind::kSpecificForce, 1, Vector3(kReach, 0.0, 0.0));
  rim.axes = Eigen::AngleAxisd(0.5 * M_PI, Vector3::UnitZ()).toRotationMatrix();
  std::vector<SensorTerm> terms;
  for (const Sensor& one : {gyro, centre, rim})
    terms.push_back(term_of(one, readings_of(one.kind, kRate, 30, nothing)));
  SensorRows rows(scene.model, terms, 0);
  rows.evaluate(scene.model, {frames, VectorX(), 0.0, kH}, 1, false);
  // With readings of zero, residuals are what the sensors would read.
  const VectorX felt = rows.of_motion().residual;
  ASSERT_EQ(rows.of_motion().size, 9);
  EXPECT_LE((felt.head<3>() - Vector3(0, 0, kSpin)).norm(), 1e-12);
  EXPECT_LE(felt.segment<3>(3).norm(), 1e-9) << "what falls freely feels nothing; 1e-9 m/s^2 is the "
                                                "round-off of positions of 5 m over h^2";
  // The second difference of a circle points to its centre: 2 r (1 - cos(spin h)) / h^2; the
  // sensor's y axis is the link's -x.
  const double pull = 2.0 * kReach * (1.0 - std::cos(kSpin * kH)) / (kH * kH);
  EXPECT_LE((felt.tail<3>() - Vector3(0, pull, 0)).norm(), 1e-9);
  EXPECT_NEAR(pull, kSpin * kSpin * kReach, 1e-3 * pull) << "spin^2 r, to the order of h^2";
}

/// Terms of every kind on a quadruped, with an offset or a delay where there can be one, and
/// readings that change linearly.
std::vector<SensorTerm> all_kinds(const Model& model) {
  std::vector<SensorTerm> out;
  const int foot = model.num_bodies() - 1;
  const Vector3 point(0.1, -0.05, 0.2);
  const auto slow = [](double t) { return Vector3(0.1 + t, 0.2 - 2.0 * t, 0.3 * t).eval(); };
  int constants = 1;  // the delay is the first
  for (const SensorKind kind :
       {SensorKind::kPoint, SensorKind::kAngularVelocity, SensorKind::kSpecificForce}) {
    Sensor sensor = sensor_on(kind, foot, point);
    sensor.axes = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
    SensorTerm& term = out.emplace_back(term_of(sensor, readings_of(kind, kRate, 60, slow)));
    term.weight = 2.0;
    term.delay_constant = 0;
    term.offset_constant = constants;
    constants += 3;
  }
  const auto turned = [](double t) {
    const Quaternion q(Eigen::AngleAxisd(0.4 + t, Vector3(0, 0.6, 0.8)));
    return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  };
  out.push_back(term_of(sensor_on(SensorKind::kOrientation, foot),
                        readings_of(SensorKind::kOrientation, kRate, 60, turned)));
  Sensor knee = sensor_on(SensorKind::kCoordinate, 0);
  knee.coordinate = model.body(foot).v_index;
  knee.position = model.body(foot).q_index;
  SensorTerm& last = out.emplace_back(
      term_of(knee, readings_of(SensorKind::kCoordinate, kRate, 60, [](double t) {
                return Eigen::Matrix<double, 1, 1>(0.1 * t);
              })));
  last.delay_constant = 0;
  last.offset_constant = constants;
  return out;
}

TEST(Sensors, ResidualsGoWithFramesAndConstantsAsTheirDerivativesSay) {
  const Scene scene = load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml");
  const Model& model = scene.model;
  const std::vector<SensorTerm> terms = all_kinds(model);
  constexpr int kConstants = 11;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<VectorX> frames(3, scene.q);
  VectorX by(model.nv()), constants(kConstants);
  for (VectorX& q : frames) {
    for (double& x : by) x = 0.02 * normal(random);
    integrate_configuration(model, scene.q, by, 1.0, q);
  }
  for (double& x : constants) x = 1e-3 * normal(random);
  SensorRows rows(model, terms, kConstants);
  const auto residual = [&] {
    rows.evaluate(model, {frames, constants, 0.1, kH}, 1, false);
    VectorX out(rows.of_frame().size + rows.of_motion().size);
    out << rows.of_frame().residual.head(rows.of_frame().size),
        rows.of_motion().residual.head(rows.of_motion().size);
    return out;
  };
  rows.evaluate(model, {frames, constants, 0.1, kH}, 1, true);
  const MatrixX by_frame = rows.of_frame().by_frames, by_motion = rows.of_motion().by_frames;
  MatrixX by_constants(by_frame.rows() + by_motion.rows(), kConstants);
  by_constants << rows.of_frame().by_constants, rows.of_motion().by_constants;
  const Eigen::Index nv = model.nv(), alone = by_frame.rows();
  ASSERT_EQ(alone, 7);
  ASSERT_EQ(by_motion.rows(), 6);
  // Differences of second differences over h^2 = 1e-4: 1e-6 rad steps leave 1e-4 of round-off and
  // of the third derivative in accelerations of 1e3 m/s^2.
  constexpr double kStep = 1e-6;
  for (int frame = 0; frame < 3; ++frame) {
    for (Eigen::Index i = 0; i < nv; ++i) {
      VectorX& q = frames[static_cast<std::size_t>(frame)];
      const VectorX at = q;
      VectorX unit = VectorX::Unit(nv, i);
      integrate_configuration(model, at, unit, kStep, q);
      const VectorX ahead = residual();
      integrate_configuration(model, at, unit, -kStep, q);
      const VectorX slope = (ahead - residual()) / (2.0 * kStep);
      q = at;
      EXPECT_LE((slope.tail(6) - by_motion.col(frame * nv + i)).norm(), 1e-6 * by_motion.norm());
      const VectorX expected = frame == 1 ? VectorX(by_frame.col(i)) : VectorX::Zero(alone);
      EXPECT_LE((slope.head(alone) - expected).norm(), 1e-7) << "coordinate " << i;
    }
  }
  for (int k = 0; k < kConstants; ++k) {
    const double at = constants[k];
    constants[k] = at + 1e-5;
    const VectorX ahead = residual();
    constants[k] = at - 1e-5;
    const VectorX slope = (ahead - residual()) / 2e-5;
    constants[k] = at;
    EXPECT_LE((slope - by_constants.col(k)).norm(), 1e-6) << "constant " << k;
  }
}

TEST(Sensors, FastReadingsAreAveragedAndGapsAreGaps) {
  const Sensor plain = sensor_on(SensorKind::kCoordinate, 0);
  SensorReadings fast = readings_of(SensorKind::kCoordinate, 1000.0, 1000, [](double t) {
    return Eigen::Matrix<double, 1, 1>(2.0 * t);
  });
  for (int row = 400; row < 500; ++row)
    fast.values(0, row) = std::numeric_limits<double>::quiet_NaN();
  const SensorSignal signal(plain, fast, kH);
  Reading value;
  ASSERT_TRUE(signal.read(0.2, value));
  EXPECT_NEAR(value[0], 0.4, 1e-12) << "means of what is linear, joined by lines";
  EXPECT_FALSE(signal.read(0.35, value)) << "nothing was read from 0.3 to 0.4 s";
  EXPECT_FALSE(signal.read(2.0, value));
  EXPECT_NEAR(signal.deviation(), 1.0 / std::sqrt(10.0), 1e-9) << "of the mean of ten";
}

TEST(Sensors, ForcesAreReadAsDifferencesOfFramesSeeThem) {
  const auto square = [](double t) { return Vector3(t * t, 1.0, t).eval(); };
  const auto read = [&](SensorKind kind) {
    const SensorSignal signal(sensor_on(kind, 0), readings_of(kind, 1000.0, 600, square), kH);
    Reading value;
    EXPECT_TRUE(signal.read_frame(0.2, kH, value));
    EXPECT_FALSE(signal.read_frame(0.6, kH, value)) << "beyond the last reading";
    EXPECT_TRUE(signal.read_frame(0.2, kH, value));
    return value;
  };
  // Lines between readings 1 ms apart are above t^2 by 1e-6 / 6 in the mean.
  const Reading triangle = read(SensorKind::kSpecificForce), box = read(SensorKind::kAngularVelocity);
  EXPECT_NEAR(triangle[0], 0.04 + kH * kH / 6.0, 2e-7) << "mean of t^2 about 0.2 s";
  EXPECT_NEAR(triangle[1], 1.0, 1e-9);
  EXPECT_NEAR(box[0], 0.195 * 0.195 + kH * kH / 12.0, 2e-7) << "mean over the interval before";
  EXPECT_NEAR(box[2], 0.195, 1e-9);
}

// ---- Estimates from sensors.

/// A quadruped that drops under random torques, with what sensors on it read every 2 ms.
struct Drop {
  explicit Drop(double seconds) : scene(load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml")) {
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

  ColumnMap map() const {
    ColumnMap out;
    for (int i = 0; i < scene.model.nq(); ++i)
      out.entries.push_back({ColumnMap::Entry::Kind::kPosition, i, "q", {"q", 1.0, 0.0}});
    return out;
  }

  /// Median error of the vertical force on all that moves, over its weight, from 0.1 s on.
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

/// An inertial unit at the trunk's origin: with noise, a clock that is late, and an offset.
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
    // Both are means over the step that begins at drop.time.
    for (SensorReadings& one : recording.sensors)
      one.time.push_back(drop.time[i] + 0.5 * h + late);
  }
}

TEST(Sensors, ReadingsOfASimulationAgreeWithItsFrames) {
  const Drop drop(0.9);
  ColumnMap map = drop.map();
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
  // Half of a normal distribution is within 0.67 deviations. Impacts shorter than the 2 ms between
  // readings miss by far more, which the median does not see.
  EXPECT_NEAR(median(sizes), 0.67, 0.3);
}

TEST(Sensors, AnInertialUnitHelpsAndItsClockAndOffsetAreFound) {
  const Drop drop(0.9);
  ColumnMap map = drop.map();
  Recording recording = drop.recording(1e-3);
  const double alone = drop.force_error(estimate_motion(drop.scene, map, recording, drop.options()));
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
  for (const SensorFigures& one : found.sensors) {
    EXPECT_GT(one.rows, 80);
    EXPECT_LE(one.outliers, one.rows / 4) << one.name << ": at impacts, which are shorter than a row";
  }
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
    recording.q.col(row) = drop.scene.q;  // nothing but markers was recorded
  }
  const MotionEstimate found = estimate_motion(drop.scene, map, recording, drop.options());
  VectorX difference(drop.scene.model.nv());
  double squares = 0.0;
  for (int row = 0; row < rows; ++row) {
    configuration_difference(drop.scene.model, truth.q.col(row), found.q.col(row), difference);
    squares += difference.squaredNorm();
  }
  // Three markers 0.1 m from a joint's axis tell its angle to 1 mm / 0.1 m / sqrt(3) or better.
  EXPECT_LE(std::sqrt(squares / (rows * drop.scene.model.nv())), 0.006);
  double kinematic = 0.0;
  for (int row = 0; row < rows; ++row) {
    configuration_difference(drop.scene.model, truth.q.col(row), found.recorded.col(row), difference);
    kinematic += difference.squaredNorm();
  }
  EXPECT_LE(std::sqrt(kinematic / (rows * drop.scene.model.nv())), 0.006);
  EXPECT_LE(drop.force_error(found), 0.05) << "weights";
  EXPECT_NEAR(found.mean_cost_ratio, 1.0, 0.3);
}

// ---- Column maps and files.

std::string written(const std::string& name, const std::string& text) {
  const std::string file = ::testing::TempDir() + "sensors_" + name;
  std::ofstream(file) << text;
  return file;
}

ColumnMap read_map(const std::string& text, const Model& model) {
  return load_column_map(written("map.yaml", text), model);
}

TEST(SensorMap, ReadsSensorsMarkersAndSources) {
  const Scene scene = test::box_on_plane({});
  const std::string link = scene.model.frames().back().name;
  written("markers.csv", "marker,link,x,y,z\nA," + link + ",0.1,0,0\nB," + link + ",0,0.2,0\n");
  const ColumnMap map = read_map(
      "rate: 100\n"
      "sources: {imu: {time: t, delay: unknown}, plate: {rate: 1000, delay: 0.01}}\n"
      "sensors:\n"
      "  unit: {kind: imu, link: " + link + ", rotation: [0, 0, 1.57], columns: [a, b, c, d, e, f],"
      " source: imu, deviation: [0.01, 0.1], offset: unknown}\n"
      "  floor: {kind: contact_force, links: [" + link + "], columns: [fx, fy, fz], source: plate}\n"
      "markers: {table: sensors_markers.csv, axes: [x, -z, y], scale: 0.001, deviation: 0.002}\n",
      scene.model);
  ASSERT_EQ(map.sensors.size(), 5u);
  EXPECT_EQ(map.sensors[0].kind, SensorKind::kAngularVelocity);
  EXPECT_EQ(map.sensors[1].kind, SensorKind::kSpecificForce);
  EXPECT_EQ(map.sensors[1].deviation, 0.1);
  EXPECT_TRUE(map.sensors[0].has_offset);
  EXPECT_EQ(map.sensors[1].columns[2].column, "f");
  EXPECT_EQ(map.sensors[4].columns[1].column, "B.z");
  EXPECT_EQ(map.sensors[4].columns[1].scale, -0.001);
  EXPECT_EQ(map.sources[1].delay, 0.01);
  EXPECT_GT(map.sources[0].delay_deviation, 0.0);
  EXPECT_THROW(refuse_sensors(map, "compare"), InputError);
}

TEST(SensorMap, RefusesWhatCannotBeMeant) {
  const Scene scene = test::box_on_plane({});
  const std::string link = scene.model.frames().back().name;
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      read_map("rate: 100\n" + text, scene.model);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const std::string& text, const std::string& words) {
    EXPECT_NE(refusal(text).find(words), std::string::npos) << text << "\n" << refusal(text);
    EXPECT_NE(refusal(text).find("map.yaml:"), std::string::npos) << "file and line";
  };
  expect("sensors: {a: {kind: sonar, link: " + link + ", columns: [x]}}", "expected one of point");
  expect("sensors: {a: {kind: point, columns: [x, y, z]}}", "expected 'link'");
  expect("sensors: {a: {kind: point, link: nowhere, columns: [x, y, z]}}", "no link of this scene");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y]}}", "a list of 3");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, 3]}}", "name of a column");
  expect("sensors: {a: {kind: imu, link: " + link + ", columns: [a, b, c, d, e, f], deviation: 1}}",
         "list of two");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, z], deviation: 0}}",
         "not positive");
  expect("sensors: {a: {kind: point, link: " + link + ", columns: [x, y, z], source: b}}",
         "not among 'sources'");
  expect("sensors: {a: {kind: orientation, link: " + link +
             ", columns: [w, x, y, z], offset: unknown}}",
         "an orientation has none");
  expect("sensors: {a: {kind: coordinate, coordinate: elbow.q, columns: [x]}}", "expected JOINT.q");
  expect("sources: {a: {delay: unknown}}\nsensors: {}", "either 'rate'");
  expect("markers: {table: x.csv, axes: [x, x, y]}", "axes");
  expect("treadmill: 3\ncolumns: {}", "a map from trajectory columns");
}

TEST(SensorFiles, ReadMissingCellsAndOtherFilesAndTreadmills) {
  const Scene scene = test::box_on_plane({});
  const std::string link = scene.model.frames().back().name;
  std::string rows = "t," + link + ".x," + link + ".z,mx,my,mz\n", plate = "t,f\n";
  for (int row = 0; row < 20; ++row) {
    const double t = 0.01 * row;
    rows += std::to_string(t) + "," + (row == 5 ? "" : row == 7 ? "nan" : std::to_string(2.0 * t)) +
            ",0.1," + (row == 3 ? "nan,nan,nan" : "1,2,3") + "\n";
  }
  for (int row = 0; row < 400; ++row) plate += std::to_string(0.0005 * row) + ",7\n";
  ColumnMap map = read_map("time: t\ntreadmill: [-1, 0, 0]\n"
                           "columns: {" + link + ".x: " + link + ".x, " + link + ".z: " + link +
                               ".z}\nsources: {plate: {time: t}}\n"
                               "contact_forces: {floor: {links: [" + link +
                               "], z: f, source: plate}}\n"
                               "sensors: {m: {kind: point, link: " + link +
                               ", columns: [mx, my, mz]}}\n",
                           scene.model);
  const std::string file = written("rows.csv", rows), plate_file = written("plate.csv", plate);
  EXPECT_THROW(read_all({file}, map, scene), InputError) << "an empty cell is asked for";
  map.missing_cells = true;
  Recording recording = read_all({file}, map, scene).front();
  EXPECT_EQ(recording.missing(0, 5), 1.0);
  EXPECT_EQ(recording.missing(0, 7), 1.0);
  EXPECT_EQ(recording.missing.sum(), 2.0);
  // On the belt the box moves at 2 m/s, against ground that moves backwards at 1 m/s at 3.
  EXPECT_NEAR(recording.q(0, 5), 3.0 * 0.05, 1e-9) << "between its neighbours";
  EXPECT_NEAR(recording.sensors[0].values(0, 10), 1.0 + 0.1, 1e-12);
  EXPECT_TRUE(std::isnan(recording.sensors[0].values(0, 3)));
  EXPECT_THROW(read_sources({}, map, recording), InputError) << "plate has no file";
  EXPECT_THROW(read_sources({{"plate", plate_file}, {"other", plate_file}}, map, recording),
               InputError);
  read_sources({{"plate", plate_file}}, map, recording);
  EXPECT_NEAR(recording.contact_force(2, 10), 7.0, 1e-12);
  const Recording part = rows_of(recording, 4, 3);
  EXPECT_EQ(part.num_rows(), 3);
  EXPECT_EQ(part.missing.sum(), 1.0);
}

}  // namespace
}  // namespace counterpoint::estimation::sensors_test
