// Sensors of a recording: readings of known motions, and derivatives of their residuals by frames
// and constants.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/sensors/force_sensors.h"
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

/// Readings from -0.1 s on at `rate` [Hz] with the values at(time).
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

/// A box that falls freely and rotates about its vertical axis at `spin` [rad/s].
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
  // With readings of zero, the residuals equal the predicted readings.
  const VectorX felt = rows.of_motion().residual;
  ASSERT_EQ(rows.of_motion().size, 9);
  EXPECT_LE((felt.head<3>() - Vector3(0, 0, kSpin)).norm(), 1e-12);
  EXPECT_LE(felt.segment<3>(3).norm(), 1e-9)
      << "what falls freely feels nothing; 1e-9 m/s^2 is the "
         "round-off of positions of 5 m over h^2";
  // The second difference on a circle points to its centre: 2 r (1 - cos(spin h)) / h^2. The
  // sensor's y axis is the link's -x axis.
  const double pull = 2.0 * kReach * (1.0 - std::cos(kSpin * kH)) / (kH * kH);
  EXPECT_LE((felt.tail<3>() - Vector3(0, pull, 0)).norm(), 1e-9);
  EXPECT_NEAR(pull, kSpin * kSpin * kReach, 1e-3 * pull) << "spin^2 r, to the order of h^2";
}

/// Number of constants of all_kinds(): a delay; four offsets, three scales; two displacements and
/// three rotations.
constexpr int kConstants = 1 + 10 + 3 + 6 + 9;

/// Terms of every kind on a quadruped, with all constants that they can have, and readings that are
/// linear in time.
std::vector<SensorTerm> all_kinds(const Model& model) {
  std::vector<SensorTerm> out;
  const int foot = model.num_bodies() - 1;
  const Vector3 point(0.1, -0.05, 0.2);
  const auto slow = [](double t) { return Vector3(0.1 + t, 0.2 - 2.0 * t, 0.3 * t).eval(); };
  int constants = 1;  // index 0 is the delay
  for (const SensorKind kind :
       {SensorKind::kPoint, SensorKind::kAngularVelocity, SensorKind::kSpecificForce}) {
    Sensor sensor = sensor_on(kind, foot, point);
    sensor.axes = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
    SensorTerm& term = out.emplace_back(term_of(sensor, readings_of(kind, kRate, 60, slow)));
    term.weight = 2.0;
    term.delay_constant = 0;
    term.offset_constant = constants;
    term.scale_constant = constants + 3;
    constants += 4;
    for (int* place : {&term.position_constant, &term.rotation_constant}) {
      const bool turns = place == &term.rotation_constant;
      if (kind == (turns ? SensorKind::kPoint : SensorKind::kAngularVelocity)) continue;
      *place = constants;
      constants += 3;
    }
  }
  const auto turned = [](double t) {
    const Quaternion q(Eigen::AngleAxisd(0.4 + t, Vector3(0, 0.6, 0.8)));
    return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  };
  out.push_back(term_of(sensor_on(SensorKind::kOrientation, foot),
                        readings_of(SensorKind::kOrientation, kRate, 60, turned)));
  out.back().rotation_constant = constants;
  constants += 3;
  Sensor knee = sensor_on(SensorKind::kCoordinate, 0);
  knee.coordinate = model.body(foot).v_index;
  knee.position = model.body(foot).q_index;
  SensorTerm& last =
      out.emplace_back(term_of(knee, readings_of(SensorKind::kCoordinate, kRate, 60, [](double t) {
                                 return Eigen::Matrix<double, 1, 1>(0.1 * t);
                               })));
  last.delay_constant = 0;
  last.offset_constant = constants;
  EXPECT_EQ(constants + 1, kConstants);
  return out;
}

TEST(Sensors, ResidualsGoWithFramesAndConstantsAsTheirDerivativesSay) {
  const Scene scene = load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml");
  const Model& model = scene.model;
  const std::vector<SensorTerm> terms = all_kinds(model);
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
  // Differences of second differences over h^2 = 1e-4: steps of 1e-6 rad leave 1e-4 of round-off
  // and third derivative in accelerations of 1e3 m/s^2.
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
    // Third derivatives of rotations over steps of 1e-4 rad are 1e-8 of the first.
    EXPECT_LE((slope - by_constants.col(k)).norm(), 1e-6 * (1.0 + slope.norm()))
        << "constant " << k;
  }
}

/// Force and moment through a link's joint at the middle of three frames, in the world frame.
std::pair<Vector3, Vector3> wrench(const Scene& scene, int body, const std::vector<VectorX>& frames,
                                   const Inverse& inverse) {
  std::vector<SensorTerm> terms;
  for (const SensorKind kind : {SensorKind::kLinkForce, SensorKind::kLinkTorque}) {
    terms.push_back(term_of(sensor_on(kind, body), readings_of(kind, kRate, 20, [](double) {
                              return Vector3::Zero().eval();
                            })));
  }
  VectorX out, constants(0);
  ForceSensors(terms).evaluate(scene.model, {frames, constants, 0.0, kH}, 1, inverse, out);
  Data data(scene.model);
  compute_poses(scene.model, frames[1], data);
  const Matrix3& R = data.X_WB[static_cast<std::size_t>(body)].rotation;
  return {R * out.head<3>(), R * out.tail<3>()};
}

Inverse inverse_of(const Scene& scene, const std::vector<VectorX>& frames) {
  SimulationOptions options = scene.options;
  options.time_step = kH;
  options.mean_velocity_forces = false;
  VectorX v(scene.model.nv()), w = v;
  configuration_difference(scene.model, frames[0], frames[1], v);
  configuration_difference(scene.model, frames[1], frames[2], w);
  Workspace workspace(scene.model);
  Inverse out;
  step_inverse(scene.model, options, frames[1], v / kH, w / kH, Input(), workspace, out);
  return out;
}

// The floating joint carries the whole robot, so its wrench is the applied force. A link at rest is
// held against the weight of all bodies that it carries.
TEST(Sensors, AWrenchIsWhatAJointPasses) {
  const Scene robot = load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml");
  Simulator simulator(robot);
  std::vector<VectorX> frames;
  while (simulator.state().time < 0.201) {  // lands at 0.14 s
    if (simulator.state().time > 0.179 &&
        simulator.state().time > 0.18 - 1e-6 + kH * static_cast<double>(frames.size()))
      frames.push_back(simulator.state().q);
    ASSERT_TRUE(simulator.step().succeeded());
  }
  ASSERT_EQ(frames.size(), 3u);
  const Inverse inverse = inverse_of(robot, frames);
  EXPECT_GT(inverse.contacts.size(), 0u);
  const auto [force, moment] = wrench(robot, 1, frames, inverse);
  EXPECT_LE((force - inverse.applied_force.head<3>()).norm(), 1e-9 * inverse.force_scale);
  Data data(robot.model);
  compute_poses(robot.model, frames[1], data);
  EXPECT_LE(
      (data.X_WB[1].rotation.transpose() * moment - inverse.applied_force.segment<3>(3)).norm(),
      1e-9 * inverse.force_scale);

  const Scene arm = load_scene(test::source_dir() + "/data/scenes/arm7.yaml");
  const std::vector<VectorX> still(3, arm.q);
  for (const int body : {1, 3, 7}) {
    double mass = 0.0;
    for (int i = body; i < arm.model.num_bodies(); ++i) mass += arm.model.body(i).inertia.mass;
    const Vector3 held = wrench(arm, body, still, inverse_of(arm, still)).first;
    EXPECT_LE((held + mass * arm.model.gravity()).norm(), 1e-9 * mass * 9.81) << body;
  }
}

TEST(Sensors, FastReadingsAreAveragedAndGapsAreGaps) {
  const Sensor plain = sensor_on(SensorKind::kCoordinate, 0);
  SensorReadings fast = readings_of(SensorKind::kCoordinate, 1000.0, 1000,
                                    [](double t) { return Eigen::Matrix<double, 1, 1>(2.0 * t); });
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
  // Linear interpolation between readings 1 ms apart exceeds t^2 by 1e-6 / 6 in the mean.
  const Reading triangle = read(SensorKind::kSpecificForce),
                box = read(SensorKind::kAngularVelocity);
  EXPECT_NEAR(triangle[0], 0.04 + kH * kH / 6.0, 2e-7) << "mean of t^2 about 0.2 s";
  EXPECT_NEAR(triangle[1], 1.0, 1e-9);
  EXPECT_NEAR(box[0], 0.195 * 0.195 + kH * kH / 12.0, 2e-7) << "mean over the interval before";
  EXPECT_NEAR(box[2], 0.195, 1e-9);
}

}  // namespace
}  // namespace counterpoint::estimation::sensors_test
