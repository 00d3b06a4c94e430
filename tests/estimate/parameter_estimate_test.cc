// Scene parameters estimated together with the motions of noisy recordings.
#include "counterpoint/engine/estimate/parameter_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/special_values.h"
#include "estimate/column_maps.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::parameter_estimate_test {
namespace {

/// Records a box that slides along x to a stop: 100 rows per second, white noise [m, rad].
Recording slide(Scene scene, double speed, double noise, unsigned seed) {
  constexpr int kRows = 60, kSubsteps = 10;
  scene.options.time_step = 0.01 / kSubsteps;
  scene.v[0] = speed;
  Simulator simulator(scene);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Recording out;
  out.file = "slide";
  const Model& model = scene.model;
  out.q.resize(model.nq(), kRows);
  out.v = out.applied_force = MatrixX::Zero(model.nv(), kRows);
  VectorX by(model.nv()), q(model.nq());
  for (int row = 0; row < kRows; ++row) {
    for (double& x : by) x = noise * normal(random);
    integrate_configuration(model, simulator.state().q, by, 1.0, q);
    out.q.col(row) = q;
    out.time.push_back(0.01 * row);
    for (int k = 0; k < kSubsteps; ++k) EXPECT_TRUE(simulator.step().succeeded());
  }
  return out;
}

ParameterEstimate estimate(const std::string& parameters, int threads) {
  const Scene truth = test::box_on_plane({.friction = 0.3}), scene = test::box_on_plane({});
  const Recording first = slide(truth, 1.2, 1e-3, 1), second = slide(truth, 0.9, 1e-3, 2);
  MotionEstimateOptions options;
  options.threads = threads;
  return estimate_parameters(scene, test::all_positions(scene.model), {&first, &second},
                             parse_parameters(parameters, scene), options);
}

// Two boxes slide for 0.41 and 0.31 s. Position noise of 1 mm leaves the deceleration over 30 to 40
// rows uncertain by 2 %, with both boxes by 1.5 %; the tolerance is three times this.
TEST(ParameterEstimate, FindsTheFrictionOfSlidingBoxes) {
  const ParameterEstimate one = estimate("friction", 1);
  ASSERT_EQ(one.parameters.parameters.size(), 1u);
  const FittedParameter& friction = one.parameters.parameters[0];
  EXPECT_NEAR(friction.value, 0.3, 0.045 * 0.3);
  ASSERT_TRUE(friction.interval);
  EXPECT_LT(friction.interval->lower, 0.3);
  EXPECT_GT(friction.interval->upper, 0.3);
  EXPECT_EQ(one.motions.size(), 2u);
  EXPECT_LT(one.cost_ratio.maxCoeff(), 2.0);
  const ParameterEstimate two = estimate("friction", 2);
  EXPECT_EQ(friction.value, two.parameters.parameters[0].value);
  EXPECT_EQ(one.motions, two.motions);
}

// Two blocks slow down within 0.4 and 0.3 s, at 3 m/s^2 first and at 6 m/s^2 when slow. Deviations
// of 0.1 mm over the 10 rows below the Stribeck speed leave the second uncertain by 3 %, thrice of
// it; sliding by half of that.
TEST(ParameterEstimate, FindsTheFrictionCurveOfABlock) {
  const Scene truth =
      test::slider({.dry_friction = 3.0, .breakaway_friction = 6.0, .stribeck_speed = 0.3});
  const Scene scene =
      test::slider({.dry_friction = 4.0, .breakaway_friction = 5.0, .stribeck_speed = 0.3});
  const Recording first = slide(truth, 1.2, 1e-4, 1), second = slide(truth, 0.9, 1e-4, 2);
  const ParameterEstimate found = estimate_parameters(
      scene, test::all_positions(scene.model), {&first, &second},
      parse_parameters("dry_friction=0..20,breakaway_friction=0..20", scene), {});
  EXPECT_NEAR(found.parameters.parameters[0].value, 3.0, 0.045 * 3.0);
  EXPECT_NEAR(found.parameters.parameters[1].value, 6.0, 0.09 * 6.0);
}

// Two blocks slow down by friction of 3 N, without a motor: a sensor of their joint force that
// reads 0.5 N too much, with noise of 0.05 N at 60 rows, leaves that uncertain by 0.005 N; five
// times of it. The friction as above.
TEST(ParameterEstimate, RecordingsShareTheOffsetOfASensor) {
  const Scene truth = test::slider({.dry_friction = 3.0});
  const Scene scene = test::slider({.dry_friction = 4.0});
  Recording first = slide(truth, 1.2, 1e-4, 1), second = slide(truth, -0.9, 1e-4, 2);
  ColumnMap map = test::all_positions(scene.model);
  Sensor& sensor = map.sensors.emplace_back();
  sensor.name = "cell";
  sensor.kind = SensorKind::kJointForce;
  sensor.coordinate = sensor.position = 0;
  sensor.deviation = 0.05;
  sensor.has_offset = true;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.5, 0.05);
  for (Recording* one : {&first, &second}) {
    SensorReadings& readings = one->sensors.emplace_back();
    readings.time = one->time;
    readings.values.resize(1, one->num_rows());
    for (double& x : readings.values.reshaped()) x = noise(random);
  }
  const auto found = estimate_parameters(scene, map, {&first, &second},
                                         parse_parameters("dry_friction=0..20", scene), {});
  ASSERT_EQ(found.parameters.parameters.size(), 1u);
  EXPECT_NEAR(found.parameters.parameters[0].value, 3.0, 0.045 * 3.0);
  ASSERT_EQ(found.constants.size(), 1u);
  EXPECT_NEAR(found.constants[0].value, 0.5, 0.025);
  EXPECT_LT(found.constants[0].deviation, 0.025);
  map.sensors[0].kind = SensorKind::kContactForce;
  EXPECT_THROW(estimate_parameters(scene, map, {&first, &second},
                                   parse_parameters("dry_friction=0..20", scene), {}),
               InputError);
}

// The motion of a free body does not depend on its mass: the estimate follows the prior, without
// interval.
TEST(ParameterEstimate, TellsWhatMotionsDoNotShow) {
  const ParameterEstimate found = estimate("mass", 1);
  EXPECT_FALSE(found.parameters.parameters[0].interval);
  // The prior holds the mass at the scene's value; noise shifts it by less than a tenth of the
  // range.
  EXPECT_NEAR(found.parameters.parameters[0].value, 1.0, 0.1);
}

/// A quadruped on its four feet that joint controllers shake, 100 rows a second with white noise:
/// of the base 1 mm and 1 mrad, of joints 0.3 mrad, of recorded joint torques 0.3 N m.
struct ShakenQuadruped {
  ShakenQuadruped() {
    scene.options.effects.set(Effect::kSleeping, false);
    scene.q[2] = 0.36;  // on its feet
    const Model& model = scene.model;
    const int nv = model.nv(), steps = kRows * kSubsteps;
    Simulator simulator(scene);
    std::vector<VectorX> q, force;
    for (int step = 0; step < steps; ++step) {
      const State& now = simulator.state();
      q.push_back(now.q);
      VectorX& u = force.emplace_back(VectorX::Zero(nv));
      for (int i = 6; i < nv; ++i) {
        const double target = scene.q[i + 1] + 0.15 * std::sin(15.0 * now.time + 1.3 * i);
        u[i] = 60.0 * (target - now.q[i + 1]) - 1.0 * now.v[i];
      }
      simulator.input().applied_force = u;
      EXPECT_TRUE(simulator.step().succeeded());
    }
    record(q, force);
    map = test::all_positions(model);
    map.free_body = 1;
    map.position_deviation = VectorX::Constant(nv, kJointNoise);
    map.position_deviation.head<6>().setConstant(kBaseNoise);
    map.force_deviation = VectorX::Constant(nv, kTorqueNoise);
    map.force_deviation.head<6>().setConstant(kInfinity);
    for (int i = 6; i < nv; ++i)
      map.entries.push_back({ColumnMap::Entry::Kind::kForce, i, "u", {}});
  }

  void record(const std::vector<VectorX>& motion, const std::vector<VectorX>& force) {
    const int nv = scene.model.nv();
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    recording.q.resize(scene.model.nq(), kRows - 10);
    recording.v = recording.applied_force = MatrixX::Zero(nv, kRows - 10);
    VectorX by(nv), q(scene.model.nq());
    for (int row = 0; row < kRows - 10; ++row) {  // without the first 0.1 s, a fall of a few mm
      const int at = (row + 10) * kSubsteps;
      for (int i = 0; i < nv; ++i) by[i] = (i < 6 ? kBaseNoise : kJointNoise) * normal(random);
      integrate_configuration(scene.model, motion[static_cast<std::size_t>(at)], by, 1.0, q);
      recording.q.col(row) = q;
      recording.time.push_back(0.01 * row);
      // Second differences of positions show forces with triangular weights.
      for (int k = 1 - kSubsteps; k < kSubsteps; ++k)
        recording.applied_force.col(row) += (kSubsteps - std::abs(k)) *
                                            force[static_cast<std::size_t>(at - 1 + k)] /
                                            (kSubsteps * kSubsteps);
      for (int i = 6; i < nv; ++i) recording.applied_force(i, row) += kTorqueNoise * normal(random);
    }
  }

  static constexpr int kRows = 80, kSubsteps = 5;
  static constexpr double kBaseNoise = 1e-3, kJointNoise = 3e-4, kTorqueNoise = 0.3;
  Scene scene = load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml");
  Recording recording;
  ColumnMap map;
};

// Joint torques tell the trunk's weight and where it acts. The search starts 30 % and centimetres
// off. Tolerances: three times the standard deviations that the estimate tells, which must be small
// themselves.
TEST(ParameterEstimate, FindsTheTrunkOfALeggedRobot) {
  const ShakenQuadruped truth;
  const Scene scene = with_settings(truth.scene, "mass:trunk=9,com_x:trunk=0.03,com_y:trunk=-0.02");
  const std::vector<Parameter> parameters =
      parse_parameters("mass:trunk,com_x:trunk,com_y:trunk", scene);
  const ParameterEstimate found =
      estimate_parameters(scene, truth.map, {&truth.recording}, parameters);
  const VectorX exact = parameter_values(parameters, truth.scene);
  for (int k = 0; k < 3; ++k) {
    const FittedParameter& one = found.parameters.parameters[static_cast<std::size_t>(k)];
    ASSERT_TRUE(one.interval) << parameters[static_cast<std::size_t>(k)].name;
    const double deviation = (one.interval->upper - one.interval->lower) / (2.0 * 1.96);
    EXPECT_LE(std::abs(one.value - exact[k]), 3.0 * deviation)
        << parameters[static_cast<std::size_t>(k)].name;
    EXPECT_LE(deviation, k == 0 ? 0.02 * exact[0] : 0.005);
    // The interval of the mass is symmetric in its logarithm: 1e-3 of its width.
    EXPECT_NEAR(std::sqrt(found.parameters.covariance(k, k)), deviation, 1e-3 * deviation);
  }
}

TEST(ParameterEstimate, ATieOfAllSurfacesIsTheirOnlyFriction) {
  const Scene scene = test::box_on_plane({});
  const auto& shapes = scene.model.geometries();
  ASSERT_EQ(shapes.size(), 2u);
  const std::string tied = "friction:" + shapes[0].name + "+" + shapes[1].name;
  EXPECT_EQ(estimate("friction", 1).parameters.values(), estimate(tied, 1).parameters.values());
}

// The recordings know the logarithm of the friction to 1.5 % (above), a prior of 0.0001 / 0.5 holds
// it 75 times as firmly: it moves by less than 1 / 75^2 of the distance to the truth, of which the
// tolerance is ten times.
TEST(ParameterEstimate, AFirmPriorHoldsAndDoesNotTell) {
  const FittedParameter held = estimate("friction~0.0001", 1).parameters.parameters[0];
  EXPECT_NEAR(held.value, 0.5, 10.0 / (75.0 * 75.0) * 0.2);
  EXPECT_FALSE(held.interval);
  const FittedParameter loose = estimate("friction~0.2", 1).parameters.parameters[0];
  EXPECT_NEAR(loose.value, 0.3, 0.045 * 0.3);
  EXPECT_TRUE(loose.interval);
}

TEST(ParameterEstimate, RefusesWhatTheSearchChangesItself) {
  for (const char* text : {"restitution", "smoothing", "size"})
    EXPECT_THROW(estimate(text, 1), InputError) << text;
  EXPECT_THROW(estimate("friction=0.6..0.9", 1), InputError) << "the scene has 0.5";
}

/// Expects the gradient by the parameters at `values` that central differences give.
void expect_parameter_gradient(const MotionProblem& problem, const VectorX& values) {
  const MotionPoint start{problem.measured, values};
  MotionFit fit(problem, start, 1);
  fit.free_parameters(true);
  constexpr double kStep = 1e-5;
  fit.begin(problem.options, start);
  fit.linearize();
  const VectorX gradient = fit.system().parameter_gradient();
  for (int k = 0; k < values.size(); ++k) {
    MotionPoint ahead = start, back = start;
    ahead.parameters[k] += kStep;
    back.parameters[k] -= kStep;
    fit.begin(problem.options, ahead);
    double difference = fit.cost();
    fit.begin(problem.options, back);
    difference -= fit.cost();
    EXPECT_GT(fit.cost(), 1.0);
    // Round-off of a cost of 1e3 over the step of a central difference, plus the step squared.
    EXPECT_NEAR(difference / (2.0 * kStep), gradient[k], 1e-7 * (1.0 + fit.cost()));
  }
}

// Unexplained forces are weighted by the mass and inertia of their bodies, so the gradient has a
// term from the dependence of these on the parameters.
TEST(MotionFit, TheGradientKnowsWhatForcesAreOver) {
  const Scene scene = test::box_on_plane({.ground = false});
  MotionProblem problem{.model = scene.model, .options = scene.options};
  problem.options.time_step = 0.01;
  problem.options.mean_velocity_forces = false;
  for (int t = 0; t < 9; ++t) {
    VectorX q = scene.q;
    q[0] += 1e-4 * t * t;
    q[4] = std::sin(1e-3 * t * t);  // sine of half the rotation angle about x
    q[3] = std::cos(1e-3 * t * t);
    problem.measured.push_back(q);
  }
  const int nv = scene.model.nv();
  problem.position_weight = MatrixX::Constant(nv, 9, 1e3);
  problem.acceleration = problem.force = MatrixX::Zero(nv, 9);
  problem.acceleration_weight = problem.force_weight = problem.change_weight = VectorX::Zero(nv);
  problem.size_weight = VectorX::Constant(nv, 1.0);
  problem.parameters = {inertia_scale_parameter(scene.model, 1), mass_parameter(scene.model, 1)};
  problem.parameter_weight = VectorX::Zero(2);
  expect_parameter_gradient(problem, VectorX::Zero(2));
  // The same where inertias are not linear in the parameters.
  problem.named = parse_parameters("mass,com_x,spread_z,com_y", scene);
  problem.named_values = parameter_values(problem.named, scene);
  problem.parameters.assign(4, mass_parameter(scene.model, 1));
  problem.parameter_weight = VectorX::Zero(4);
  expect_parameter_gradient(problem, (VectorX(4) << 0.1, 0.02, 0.05, -0.03).finished());
}

}  // namespace
}  // namespace counterpoint::estimation::parameter_estimate_test
