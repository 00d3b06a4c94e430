// Motions and forces estimated from noisy recordings, against the recorded motions.
#include "counterpoint/engine/estimate/motion_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion/frame_covariance.h"
#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::motion_estimate_test {
namespace {

constexpr double kGravity = 9.80665;

/// Records every `substeps`-th state of a simulation under random joint torques; `torque`: standard
/// deviation [N m].
Recording simulate(const Scene& scene, int rows, int substeps, double torque = 0.0) {
  Simulator simulator(scene);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Recording out;
  out.file = "simulated";
  out.q.resize(scene.model.nq(), rows);
  out.v.resize(scene.model.nv(), rows);
  out.applied_force = MatrixX::Zero(scene.model.nv(), rows);
  VectorX& force = simulator.input().applied_force;
  force = VectorX::Zero(scene.model.nv());
  for (int row = 0; row < rows; ++row) {
    out.time.push_back(simulator.state().time);
    out.q.col(row) = simulator.state().q;
    out.v.col(row) = simulator.state().v;
    for (int k = 0; k < substeps; ++k) {
      for (int i = 6; i < scene.model.nv(); ++i) force[i] = torque * normal(random);
      EXPECT_TRUE(simulator.step().succeeded());
    }
  }
  return out;
}

/// Returns the recording without velocities and with white noise on its positions [m, rad].
Recording noisy(const Model& model, const Recording& recording, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Recording out = recording;
  out.v.setZero();
  VectorX by(model.nv()), q(model.nq());
  for (int row = 0; row < out.num_rows(); ++row) {
    for (double& x : by) x = noise * normal(random);
    integrate_configuration(model, recording.q.col(row), by, 1.0, q);
    out.q.col(row) = q;
  }
  return out;
}

/// Vertical contact force on all moving bodies over their weight, per row, from the acceleration of
/// the centre of mass: the mean over both intervals around the row.
std::vector<double> true_support(const Model& model, const Recording& recording) {
  Dynamics dynamics(model);
  std::vector<double> height, out(static_cast<std::size_t>(recording.num_rows()), 0.0);
  for (int row = 0; row < recording.num_rows(); ++row) {
    dynamics.set_configuration(recording.q.col(row));
    height.push_back(dynamics.center_of_mass().z());
  }
  const double h = recording.time[1] - recording.time[0];
  for (std::size_t t = 1; t + 1 < out.size(); ++t)
    out[t] = 1.0 + (height[t + 1] - 2.0 * height[t] + height[t - 1]) / (h * h * kGravity);
  return out;
}

Scene quadruped() {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml");
  scene.options.effects.set(Effect::kSleeping, false);
  return scene;
}

MotionEstimateOptions all_bodies(const Model& model) {
  MotionEstimateOptions options;
  ContactSum& all = options.sums.emplace_back();
  all.name = "all";
  for (int b = 1; b < model.num_bodies(); ++b) all.bodies.push_back(b);
  return options;
}

// A motion of the engine itself needs no estimate; the result is that of the inverse.
TEST(MotionEstimate, OwnMotionsComeBackAsTheInverseGivesThem) {
  const Scene scene = quadruped();
  const Recording recording = simulate(scene, 200, 1, 0.3);
  const MotionEstimate estimate =
      estimate_motion(scene, test::all_positions(scene.model), recording);
  ASSERT_EQ(estimate.errors, RecordingErrors::kNone);
  Workspace workspace(scene.model);
  Inverse inverse;
  for (int row = 0; row + 1 < recording.num_rows(); ++row) {
    step_inverse(scene.model, scene.options, recording.q.col(row), recording.v.col(row),
                 recording.q.col(row + 1), recording.v.col(row + 1), Input(), workspace, inverse);
    EXPECT_LE((estimate.force.col(row) - inverse.applied_force).cwiseAbs().maxCoeff(),
              1e-8 * inverse.force_scale);
    Vector3 sum = Vector3::Zero(), told = Vector3::Zero();
    for (const ContactForce& one : inverse.contacts) sum += one.force;
    for (const ContactEstimate& one : estimate.contacts[static_cast<std::size_t>(row)])
      told += one.force;
    EXPECT_LE((told - sum).norm(), 1e-8 * inverse.force_scale);
  }
  EXPECT_LT(estimate.unexplained_max, 1e-7);
}

// A quadruped drops under random torques, 100 rows per second with 1 mm and 1 mrad of noise.
// Bounds: twice the errors of an estimate with manually chosen weights (rms 0.14, median 0.015
// weights).
TEST(MotionEstimate, ForcesOfANoisyDropAreFound) {
  const Scene scene = quadruped();
  const Recording recorded = simulate(scene, 100, 5, 0.3);
  const Recording noise = noisy(scene.model, recorded, 1e-3, 3);
  const MotionEstimate estimate =
      estimate_motion(scene, test::all_positions(scene.model), noise, all_bodies(scene.model));
  EXPECT_EQ(estimate.errors, RecordingErrors::kWhite);
  const std::vector<double> truth = true_support(scene.model, recorded);
  double weight = 0.0, squares = 0.0;
  for (const Body& body : scene.model.bodies()) weight += kGravity * body.inertia.mass;
  std::vector<double> errors;
  int inside = 0;
  for (int row = 10; row + 1 < recorded.num_rows(); ++row) {
    const double error = estimate.sum_force(2, row) / weight - truth[static_cast<std::size_t>(row)];
    errors.push_back(std::abs(error));
    squares += error * error;
    if (std::abs(error) <= 1.96 * estimate.sum_deviation(2, row) / weight + 1e-6) ++inside;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(errors.size())), 0.28);
  EXPECT_LT(median(errors), 0.03);
  // At least two thirds: a third of these rows are impacts, biased because rows cannot resolve
  // them.
  EXPECT_GT(3 * inside, 2 * static_cast<int>(errors.size()));
  EXPECT_GT(estimate.mean_cost_ratio, 0.5);
  EXPECT_LT(estimate.mean_cost_ratio, 2.0);
}

// A sine of 1 cm in the recorded base position is neither a possible motion under the forces here
// nor white noise.
TEST(MotionEstimate, SlowErrorsAreToldFromWhiteOnes) {
  const Scene scene = test::box_on_plane({});
  Recording recording = noisy(scene.model, simulate(scene, 100, 5), 1e-4, 5);
  for (int row = 0; row < recording.num_rows(); ++row)
    recording.q(2, row) += 0.01 * std::sin(9.42 * recording.time[static_cast<std::size_t>(row)]);
  const MotionEstimate estimate =
      estimate_motion(scene, test::all_positions(scene.model), recording, all_bodies(scene.model));
  EXPECT_EQ(estimate.errors, RecordingErrors::kSlow);
  EXPECT_TRUE(estimate.q.allFinite());
}

// The ground carries the weight of a box at rest, for any number of threads.
TEST(MotionEstimate, ARestingBoxIsCarriedByTheGround) {
  const Scene scene = test::box_on_plane({.mass = 2.0});
  const Recording recording = noisy(scene.model, simulate(scene, 60, 5), 1e-3, 7);
  MotionEstimateOptions options = all_bodies(scene.model);
  options.threads = 1;
  const MotionEstimate one =
      estimate_motion(scene, test::all_positions(scene.model), recording, options);
  options.threads = 2;
  const MotionEstimate two =
      estimate_motion(scene, test::all_positions(scene.model), recording, options);
  EXPECT_EQ(one.q, two.q);
  double sum = 0.0;
  for (int row = 10; row < 50; ++row) sum += one.sum_force(2, row) / 40.0;
  EXPECT_NEAR(sum, 2.0 * 9.81, 0.05 * 2.0 * 9.81);
  for (int row = 10; row < 50; ++row) {
    EXPECT_NEAR(one.sum_centre(0, row), 0.0, 0.1);
    EXPECT_GT(one.sum_deviation(2, row), 0.0);
  }
}

TEST(MotionEstimate, SpikesAreNamedAndImpactsAreNone) {
  const Scene scene = test::pendulum({});
  Recording recording = simulate(scene, 100, 5);
  for (int row = 0; row < 100; ++row)
    recording.q(0, row) = 0.1 * std::sin(3.0 * recording.time[static_cast<std::size_t>(row)]);
  recording.q(0, 40) += 0.2;
  for (int row = 70; row < 100; ++row)  // strikes a stop and rebounds
    recording.q(0, row) = recording.q(0, 70) - 0.05 * (row - 70);
  const RecordedMotion motion = prepare(scene.model, test::all_positions(scene.model), recording);
  ASSERT_EQ(motion.spikes.size(), 1u);
  EXPECT_EQ(motion.spikes[0].row, 40);
  EXPECT_NEAR(motion.spikes[0].difference, 0.2, 1e-3);
  EXPECT_EQ(motion.measured(0, 40), 0.0);
}

TEST(MotionEstimate, UnevenRowsAreMadeEven) {
  const Scene scene = test::pendulum({});
  Recording recording = simulate(scene, 60, 5);
  for (int row = 0; row < 60; ++row)
    recording.time[static_cast<std::size_t>(row)] += row % 3 == 1 ? 0.004 : 0.0;
  recording.time.back() += 0.1;  // a gap
  const RecordedMotion motion = prepare(scene.model, test::all_positions(scene.model), recording);
  EXPECT_TRUE(motion.resampled);
  const double h = motion.time[1] - motion.time[0];
  for (std::size_t row = 1; row < motion.time.size(); ++row)
    EXPECT_NEAR(motion.time[row] - motion.time[row - 1], h, 1e-12);
  EXPECT_EQ(motion.measured(0, motion.rows() - 3), 0.0) << "inside the gap";
}

TEST(MotionEstimate, RefusesWhatIsTooShortOrWithoutPositions) {
  const Scene scene = test::pendulum({});
  EXPECT_THROW(
      estimate_motion(scene, test::all_positions(scene.model), simulate(scene, kLeastRows - 1, 1)),
      InputError);
  EXPECT_THROW(estimate_motion(scene, ColumnMap(), simulate(scene, 30, 1)), InputError);
}

// ---- Normal equations ----------------------------------------------------------------------

/// A box on soft ground with every kind of residual, including parameters, and no kink within a
/// difference.
struct SmallProblem {
  SmallProblem() {
    Scene scene = test::box_on_plane({.height = 1e-3});
    problem.model = scene.model;
    problem.options = scene.options;
    problem.options.time_step = 0.01;
    problem.options.mean_velocity_forces = false;
    problem.options.contact.smoothing = 1e-2;
    problem.options.contact.compliance = 0.1;
    problem.options.contact.margin = 0.05;
    problem.options.contact.reach_acceleration = problem.options.contact.slip_time = 1e9;
    problem.options.push_deep = true;
    const int nv = scene.model.nv(), frames = 9;
    std::mt19937 random(2);
    std::normal_distribution<double> normal;
    VectorX by(nv), q(scene.model.nq());
    for (int t = 0; t < frames; ++t) {
      problem.measured.push_back(scene.q);
      for (double& x : by) x = 1e-3 * normal(random);
      integrate_configuration(scene.model, scene.q, by, 1.0, q);
      point.q.push_back(q);
    }
    problem.position_weight = MatrixX::Constant(nv, frames, 100.0);
    problem.acceleration = MatrixX::Constant(nv, frames, 0.3);
    problem.acceleration_weight = VectorX::Constant(nv, 0.2);
    problem.loss_scale = 2.0;
    problem.force = MatrixX::Constant(nv, frames, 1.0);
    problem.force_weight = VectorX::Constant(nv, 0.01);
    problem.size_weight = VectorX::Constant(nv, 0.05);
    problem.change_weight = VectorX::Constant(nv, 0.02);
    StepParameter& place = problem.parameters.emplace_back();
    place.kind = StepParameterKind::kHeight;
    place.targets = {0};
    place.directions = {Vector3(0.6, 0.0, -0.8)};
    problem.parameter_weight = VectorX::Constant(1, 50.0);
    point.parameters = VectorX::Constant(1, 2e-4);
  }
  MotionProblem problem{.model = test::box_on_plane({}).model, .options = {}};
  MotionPoint point;
};

/// Adds sensors on the box: a point, an inertial unit, a force plate, a joint force and a wrench;
/// with offsets, a scale, and the placement of the wrench.
struct SmallProblemWithSensors : SmallProblem {
  SmallProblemWithSensors() {
    int constants = 0;
    for (const SensorKind kind :
         {SensorKind::kPoint, SensorKind::kAngularVelocity, SensorKind::kSpecificForce,
          SensorKind::kContactForce, SensorKind::kLinkForce, SensorKind::kLinkTorque}) {
      Sensor sensor;
      sensor.kind = kind;
      sensor.body = 1;
      sensor.bodies = {1};
      sensor.point = Vector3(0.05, 0.02, 0.1);
      sensor.deviation = kind == SensorKind::kPoint ? 2e-3 : 5.0;
      SensorReadings readings;
      readings.values = MatrixX::Constant(3, 20, 0.1);
      for (int row = 0; row < 20; ++row) readings.time.push_back(0.01 * (row - 5));
      SensorTerm& term = problem.sensors.emplace_back(
          SensorTerm{.sensor = sensor, .signal = SensorSignal(sensor, readings, 0.01)});
      term.weight = 1.0 / sensor.deviation;
      if (kind == SensorKind::kPoint || kind == SensorKind::kContactForce) {
        term.offset_constant = constants;
        constants += 3;
      }
      if (kind == SensorKind::kSpecificForce) term.scale_constant = constants++;
      if (kind == SensorKind::kLinkTorque) {
        term.position_constant = constants;
        term.rotation_constant = constants + 3;
        constants += 6;
      }
    }
    problem.sensor_loss_scale = 2.0;
    problem.constants.resize(static_cast<std::size_t>(constants));
    problem.parameter_weight = VectorX::Constant(1 + constants, 50.0);
    point.parameters = VectorX::Constant(1 + constants, 2e-4);
  }
};

TEST(MotionFit, TheGradientWithSensorsIsThatOfTheCost) {
  SmallProblemWithSensors small;
  MotionFit fit(small.problem, small.point, 1);
  fit.begin(small.problem.options, small.point);
  const MotionSystem& system = fit.linearized();
  const MatrixX gradient = system.gradient();
  const VectorX by_constants = system.parameter_gradient();
  constexpr double kStep = 1e-6;
  // Tolerance as in TheGradientIsThatOfTheCost; differences inside the contact forces add a
  // relative 1e-6.
  const double tolerance = 1e-5 * gradient.cwiseAbs().maxCoeff();
  const auto cost = [&](const MotionPoint& point) {
    fit.begin(small.problem.options, point);
    return fit.cost();
  };
  for (const int t : {0, 1, 4, 8})
    for (int i = 0; i < small.problem.nv(); ++i) {
      MotionPoint ahead = small.point, back = small.point;
      const VectorX unit = VectorX::Unit(small.problem.nv(), i);
      const auto frame = static_cast<std::size_t>(t);
      integrate_configuration(small.problem.model, small.point.q[frame], unit, kStep,
                              ahead.q[frame]);
      integrate_configuration(small.problem.model, small.point.q[frame], unit, -kStep,
                              back.q[frame]);
      EXPECT_NEAR((cost(ahead) - cost(back)) / (2.0 * kStep), gradient(i, t), tolerance)
          << "frame " << t << ", coordinate " << i;
    }
  for (int k = 1; k < by_constants.size(); ++k) {
    MotionPoint ahead = small.point, back = small.point;
    ahead.parameters[k] += kStep;
    back.parameters[k] -= kStep;
    EXPECT_NEAR((cost(ahead) - cost(back)) / (2.0 * kStep), by_constants[k],
                1e-5 * by_constants.cwiseAbs().maxCoeff())
        << "constant " << k;
  }
}

TEST(MotionFit, TheGradientIsThatOfTheCost) {
  SmallProblem small;
  MotionFit fit(small.problem, small.point, 1);
  fit.free_parameters(true);
  fit.begin(small.problem.options, small.point);
  const MotionSystem& system = fit.linearized();
  const MatrixX gradient = system.gradient();
  const VectorX by_parameter = system.parameter_gradient();
  constexpr double kStep = 1e-6;
  // Central differences of a cost of about 1e2 with third derivatives of 1e6: 1e-6 of 1e4.
  const double tolerance = 1e-5 * gradient.cwiseAbs().maxCoeff();
  const auto cost = [&](const MotionPoint& point) {
    fit.begin(small.problem.options, point);
    return fit.cost();
  };
  for (const int t : {0, 1, 4, 8})
    for (int i = 0; i < small.problem.nv(); ++i) {
      MotionPoint ahead = small.point, back = small.point;
      VectorX unit = VectorX::Zero(small.problem.nv());
      unit[i] = kStep;
      const auto frame = static_cast<std::size_t>(t);
      integrate_configuration(small.problem.model, small.point.q[frame], unit, 1.0, ahead.q[frame]);
      integrate_configuration(small.problem.model, small.point.q[frame], unit, -1.0, back.q[frame]);
      EXPECT_NEAR((cost(ahead) - cost(back)) / (2.0 * kStep), gradient(i, t), tolerance)
          << "frame " << t << ", coordinate " << i;
    }
  MotionPoint ahead = small.point, back = small.point;
  ahead.parameters[0] += kStep;
  back.parameters[0] -= kStep;
  EXPECT_NEAR((cost(ahead) - cost(back)) / (2.0 * kStep), by_parameter[0],
              1e-5 * std::abs(by_parameter[0]));
}

TEST(FrameCovariance, IsTheInverseAtItsPlaces) {
  constexpr int kSize = 4, kFrames = 9, kWidth = 3;
  optimization::BlockCholesky band(kFrames, kSize, false, kWidth);
  MatrixX dense = MatrixX::Zero(kFrames * kSize, kFrames * kSize);
  std::srand(3);  // seeds Eigen's Random
  for (int t = 0; t + kWidth < kFrames; ++t) {
    MatrixX J = MatrixX::Zero(12, kFrames * kSize);
    J.middleCols(t * kSize, (kWidth + 1) * kSize).setRandom();
    dense += J.transpose() * J;
  }
  dense.diagonal().array() += 0.1;
  for (int i = 0; i < kFrames; ++i)
    for (int j = std::max(0, i - kWidth); j <= i; ++j)
      band.block(i, j) = dense.block(i * kSize, j * kSize, kSize, kSize);
  const FrameCovariance covariance(band);
  const MatrixX inverse = dense.inverse();
  for (const int count : {3, 4})
    for (int first = 0; first + count <= kFrames; ++first) {
      const MatrixX expected =
          inverse.block(first * kSize, first * kSize, count * kSize, count * kSize);
      // The condition number is about 1e3.
      EXPECT_LT((covariance.of(first, count) - expected).cwiseAbs().maxCoeff(),
                1e-10 * expected.cwiseAbs().maxCoeff())
          << first << ", " << count;
    }
}

}  // namespace
}  // namespace counterpoint::estimation::motion_estimate_test
