// Estimates from motions with known contact forces and hard impacts: an arm that strikes a table
// with its torques measured, and a cube that bounces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/paths.h"

namespace counterpoint::estimation::known_forces_test {
namespace {

constexpr double kNoise = 1e-3;  // standard deviation of positions [m, rad]

Scene bundled(const std::string& name) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/" + name + ".yaml");
  scene.options.effects.set(Effect::kSleeping, false);
  return scene;
}

/// Simulated rows at 100 Hz and the forces of the steps. The force of a row is the mean over the
/// steps around it with triangular weights.
struct Simulated {
  Simulated(const Scene& scene, int rows) : simulator(scene) {
    recording.file = "simulated";
    recording.q.resize(scene.model.nq(), rows);
    recording.v = recording.applied_force = MatrixX::Zero(scene.model.nv(), rows);
  }

  void step() {
    ASSERT_TRUE(simulator.step().succeeded());
    const Inverse& last = simulator.last_forces();
    VectorX& joints = joint_force.emplace_back(last.applied_force);
    if (last.servo_force.size() > 0) joints += last.servo_force;
    double& up = vertical.emplace_back(0.0);
    for (const ContactForce& one : last.contacts) up += std::abs(one.force.z());
  }

  void record(int row) {
    VectorX by(simulator.model().nv()), q(simulator.model().nq());
    for (double& x : by) x = kNoise * normal(random);
    integrate_configuration(simulator.model(), simulator.state().q, by, 1.0, q);
    recording.q.col(row) = q;
    recording.time.push_back(simulator.state().time);
  }

  /// Mean over the steps around a row, with triangular weights.
  template <class T>
  T around(const std::vector<T>& steps, int row, int substeps) const {
    const int at = row * substeps;
    T sum = steps[static_cast<std::size_t>(at)];
    for (int k = 1; k < substeps; ++k)
      sum += (1.0 - static_cast<double>(k) / substeps) *
             T(steps[static_cast<std::size_t>(at - k)] + steps[static_cast<std::size_t>(at + k)]);
    return sum / substeps;
  }

  Simulator simulator;
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  Recording recording;
  std::vector<VectorX> joint_force;
  std::vector<double> vertical;
};

// Measured torques that jump by ten times their usual size at an impact are not outliers, although
// the search starts without the contact that explains them.
TEST(KnownForces, AnArmStrikesATableWithItsTorquesMeasured) {
  constexpr int kRows = 130, kSubsteps = 5;
  const Scene scene = bundled("arm7"), held = bundled("arm7_servo");
  Simulated truth(held, kRows);
  ColumnMap map = test::all_positions(scene.model);
  const int nv = scene.model.nv();
  for (int row = 0; row < kRows; ++row) {
    truth.record(row);
    for (int k = 0; k < kSubsteps; ++k) {
      VectorX& target = truth.simulator.input().servo_position;
      target = held.q;
      target[1] += 0.66 * std::min(1.0, truth.simulator.state().time / 0.6);
      truth.step();
    }
  }
  for (int i = 0; i < nv; ++i) {
    Sensor& sensor = map.sensors.emplace_back();
    sensor.name = "torque";
    sensor.kind = SensorKind::kJointForce;
    sensor.coordinate = i;
    sensor.deviation = 1.0;  // [N m]
    SensorReadings& readings = truth.recording.sensors.emplace_back();
    readings.values.resize(1, kRows - 2);
    for (int row = 1; row + 1 < kRows; ++row) {
      readings.time.push_back(truth.recording.time[static_cast<std::size_t>(row)]);
      readings.values(0, row - 1) =
          truth.around(truth.joint_force, row, kSubsteps)[i] + truth.normal(truth.random);
    }
  }
  MotionEstimateOptions options;
  options.sums = {{"all", {}}};
  for (int b = 1; b < scene.model.num_bodies(); ++b) options.sums[0].bodies.push_back(b);
  const MotionEstimate estimate = estimate_motion(scene, map, truth.recording, options);
  std::vector<double> shares, deviations;
  for (int row = 90; row + 1 < kRows; ++row) {  // after the impact at 0.5 s
    const double force = truth.around(truth.vertical, row, kSubsteps);
    EXPECT_GT(force, 100.0);  // [N]
    deviations.push_back(estimate.sum_deviation(2, row));
    shares.push_back(std::abs(estimate.sum_force(2, row) - force) / deviations.back());
  }
  // Deviations are below a tenth of the contact force. The median of a normal distribution is 0.67
  // deviations; neighbouring errors are correlated, so twice that is allowed.
  EXPECT_LT(median(deviations), 10.0);
  EXPECT_LT(median(shares), 1.34);
}

// Estimates have no restitution law, and rows blur an impact, which misleads a search that starts
// from the blurred motion. The impulse of the first impacts must still be found.
TEST(KnownForces, ACubeThatBouncesHasWhiteErrorsAndTheRightImpulse) {
  Scene scene = bundled("cube_toss");
  constexpr int kRows = 100, kSubsteps = 5;
  for (const double spin : {-5.0, 3.0}) {
    scene.v << 0.9, 0.2, 0.6, spin, -4.0, 2.0;
    Simulated truth(scene, kRows);
    for (int row = 0; row < kRows; ++row) {
      truth.record(row);
      for (int k = 0; k < kSubsteps; ++k) truth.step();
    }
    MotionEstimateOptions options;
    options.sums = {{"cube", {1}}};
    const MotionEstimate estimate =
        estimate_motion(scene, test::all_positions(scene.model), truth.recording, options);
    EXPECT_EQ(estimate.errors, RecordingErrors::kWhite) << spin;
    double found = 0.0, impulse = 0.0;
    for (int row = 2; row + 1 < kRows; ++row) {
      found += estimate.sum_force(2, row);
      impulse += truth.around(truth.vertical, row, kSubsteps);
    }
    EXPECT_NEAR(found, impulse, 0.05 * impulse) << spin;
  }
}

}  // namespace
}  // namespace counterpoint::estimation::known_forces_test
