// Parameters found by predictions of noisy recordings whose truth is known.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/paths.h"
#include "support/small_scenes.h"
#include "support/temp_folder.h"

namespace counterpoint::estimation::rollout_parameters_test {
namespace {

/// Records a simulation of the scene every `substeps` steps, with white noise on the first three
/// positions [m, rad] and five times as much on others. input: sets the inputs at a time [s].
Recording record(const Scene& scene, int rows, int substeps, double noise, unsigned seed,
                 const InputColumns& columns = {},
                 const std::function<void(double time, Input&)>& input = {}) {
  const Model& model = scene.model;
  Simulator simulator(scene);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Recording out;
  out.file = "simulated";
  out.q.resize(model.nq(), rows);
  out.v.resize(model.nv(), rows);
  out.applied_force = MatrixX::Zero(model.nv(), rows);
  VectorX by(model.nv()), q(model.nq());
  for (int row = 0; row < rows; ++row) {
    const State& now = simulator.state();
    for (int i = 0; i < model.nv(); ++i) by[i] = noise * (i < 3 ? 1.0 : 5.0) * normal(random);
    integrate_configuration(model, now.q, by, 1.0, q);
    out.time.push_back(now.time);
    out.q.col(row) = q;
    out.v.col(row) = now.v;
    if (input) {
      input(now.time, simulator.input());
      out.inputs.conservativeResize(static_cast<Eigen::Index>(columns.names(model).size()), rows);
      out.inputs.col(row) = columns.values(model, simulator.input());
    }
    for (int k = 0; k < substeps; ++k) EXPECT_TRUE(simulator.step().succeeded());
  }
  return out;
}

/// Balls of 0.5 kg thrown with spin onto soft ground, 200 rows a second with 0.1 mm of noise.
Experiment thrown_balls() {
  test::BallOnPlane ball{.mass = 0.5};
  ball.material.friction = 0.2;
  ball.material.static_friction = 0.5;
  ball.material.stribeck_speed = 0.2;
  ball.material.stiffness = 4e4;  // two surfaces in series: 2e4 N/m
  ball.material.dissipation = 0.3;
  Scene scene = test::ball_on_plane(ball);
  scene.options.time_step = 5e-4;
  Experiment e{scene, test::all_positions(scene.model), {}, 0, {}, false, 0.01};
  e.map.free_body = 1;
  e.prediction.substeps = 10;
  struct Throw {
    double height;
    Vector3 velocity, spin;
  };
  const double sunk = -0.5 * 9.81 / 2e4;  // at rest
  unsigned seed = 1;
  for (const Throw& one :
       {Throw{0.05, {2, 0, -0.5}, {0, -20, 0}}, Throw{sunk, {1.5, 0.5, 0}, {0, 0, 0}},
        Throw{0.1, {0.5, 0, 0}, {5, -10, 0}}, Throw{sunk, {1, -0.5, 0}, {0, 0, 0}},
        Throw{sunk, {0.7, 0, 0}, {3, 0, 0}}, Throw{sunk, {0, 0.8, 0}, {0, -6, 0}},
        Throw{0.05, {0, 0.8, 0}, {0, -6, 0}}, Throw{sunk, {0, -0.5, 0}, {0, -5, 10}}}) {
    scene.q[2] = 0.1 + one.height;
    scene.v << one.velocity, one.spin;
    e.recordings.push_back(record(scene, 140, 10, 1e-4, seed++));
  }
  e.num_given = static_cast<int>(e.recordings.size());
  return e;
}

// Sliding, the end of sliding and bounces tell one parameter each. The search starts with twice the
// friction and 2.5 times the stiffness. Tolerances: friction and stiffness are told to 0.1 and 0.3
// % by these eight throws (scatter over three seeds of noise), static friction, which acts only
// below 0.2 m/s, to 9 %; three times that.
TEST(RolloutParameters, StaticFrictionAndStiffnessOfABall) {
  const Experiment truth = thrown_balls();
  Experiment e = truth;
  e.scene = with_settings(truth.scene, "static_friction=0.8,friction=0.4,stiffness=1e5");
  const std::vector<Parameter> parameters =
      parse_parameters("friction=0.05..0.6,static_friction=0.3..1.2,stiffness=4e3..4e5", e.scene);
  std::vector<int> which;
  for (int i = 0; i < e.num_given; ++i) which.push_back(i);
  const FitProblem problem = fit_problem(e, parameters, which, false);
  FitOptions options;
  options.samples = 32;
  options.refined = 1;
  const Fit found = fit(problem, options);
  const VectorX values = found.values();
  EXPECT_NEAR(values[0], 0.2, 3e-3 * 0.2);
  EXPECT_NEAR(values[1], 0.5, 0.27 * 0.5);
  EXPECT_NEAR(values[2], 4e4, 9e-3 * 4e4);
  for (int k = 0; k < 3; ++k) {
    const FittedParameter& one = found.parameters[static_cast<std::size_t>(k)];
    ASSERT_TRUE(one.interval) << parameters[static_cast<std::size_t>(k)].name;
    const double width = one.interval->upper - one.interval->lower;
    EXPECT_LT(width, (k == 1 ? 1.0 : 0.05) * one.value) << "told, not merely within bounds";
  }
}

/// Fits all recordings of an experiment row by row.
Fit fit_rows(const Experiment& e, const std::vector<Parameter>& parameters) {
  std::vector<int> which;
  for (int i = 0; i < e.num_given; ++i) which.push_back(i);
  FitOptions options;
  options.samples = 16;
  options.refined = 1;
  options.robust = false;
  return fit(fit_problem(e, parameters, which, false), options);
}

/// A double pendulum with these dynamics and actuators, moved by inputs that are recorded.
struct Machine {
  Machine(const std::string& dynamics, const std::string& actuators) {
    const std::string urdf = test::source_dir() + "/data/robots/double_pendulum.urdf";
    scene = load_scene(folder.write("machine.yaml",
                                    "name: machine\ntime_step: 0.002\nmodels:\n"
                                    "  - urdf: " +
                                        urdf +
                                        "\n    base: fixed\n"
                                        "    joints: {shoulder: 0.4, elbow: -0.3}\n"
                                        "    dynamics:\n" +
                                        dynamics + actuators));
  }

  /// Moves every servo and actuator along sines. Rows of 10 ms, noise of 1e-5 rad.
  Experiment experiment() const {
    Experiment e{scene, test::all_positions(scene.model), {}, 1, {}, false, 0.01};
    e.map.input_columns = InputColumns::of(scene.model);
    e.map.inputs.resize(1);  // the columns are those of the scene
    e.prediction.substeps = 5;
    e.recordings.push_back(
        record(scene, 200, 5, 2e-6, 1, e.map.input_columns, [&](double t, Input& input) {
          const auto servos = static_cast<Eigen::Index>(scene.model.servos().size());
          input.servo_position.resize(servos);
          input.servo_velocity = VectorX::Zero(servos);
          for (Eigen::Index i = 0; i < servos; ++i)
            input.servo_position[i] = 0.3 * std::sin(4.0 * t + static_cast<double>(i));
          input.command.resize(static_cast<Eigen::Index>(scene.model.actuators().size()));
          for (Eigen::Index i = 0; i < input.command.size(); ++i)
            input.command[i] = 6.0 * std::sin(7.0 * t + static_cast<double>(i));
        }));
    return e;
  }

  test::TempFolder folder;
  Scene scene;
};

/// Expects these values from a scene that `wrong` has set, within `tolerance` of them (of 1 where
/// they are below).
void expect_found(const Machine& truth, const std::string& wrong, const std::string& names,
                  const std::vector<double>& values, double tolerance) {
  Experiment e = truth.experiment();
  e.scene = with_settings(truth.scene, wrong);
  const std::vector<Parameter> parameters = parse_parameters(names, e.scene);
  ASSERT_EQ(parameters.size(), values.size());
  const Fit found = fit_rows(e, parameters);
  for (std::size_t k = 0; k < parameters.size(); ++k)
    EXPECT_NEAR(found.parameters[k].value, values[k],
                tolerance * std::max(std::abs(values[k]), 1.0))
        << parameters[k].name;
}

// The recorded targets are replayed: without noise the prediction is the recording, to rounding.
TEST(RolloutParameters, RecordedInputsAreReplayed) {
  const Machine machine("      all: {servo: {stiffness: 200, damping: 5}}\n", "");
  Experiment e = machine.experiment();
  const Prediction noisy = Predictor(e.scene, e.map, e.prediction).predict(e.recordings[0]);
  EXPECT_LT(noisy.mean.joints, 1e-4) << "noise";
  e.recordings[0].inputs.setZero();
  const Prediction still = Predictor(e.scene, e.map, e.prediction).predict(e.recordings[0]);
  EXPECT_GT(still.mean.joints, 0.05);
}

// Two hundred rows with 1e-5 rad of noise tell each of these parameters to about 1e-4 of it. The
// tolerance is a part in a thousand.
TEST(RolloutParameters, GainsOfServosAndSpringsOfJoints) {
  const Machine machine(
      "      shoulder: {servo: {stiffness: 200, damping: 5}}\n"
      "      elbow: {stiffness: 30, reference: 0.2, damping: 0.4}\n",
      "");
  expect_found(machine, "servo_stiffness:shoulder=300,servo_damping:shoulder=3",
               "servo_stiffness:shoulder,servo_damping:shoulder", {200, 5}, 1e-3);
  expect_found(machine, "spring_stiffness:elbow=20,spring_reference:elbow=0.1",
               "spring_stiffness:elbow,spring_reference:elbow", {30, 0.2}, 1e-3);
}

TEST(RolloutParameters, ConstantsOfMotorsAndGears) {
  const Machine machine("      all: {damping: 0.4}\n",
                        "actuators:\n"
                        "  - {name: motor, joint: shoulder, gear: 20, "
                        "dc_motor: {torque_constant: 0.1, resistance: 1.5}}\n"
                        "  - {name: push, joint: elbow, gain: 0.3}\n");
  expect_found(machine, "torque_constant:motor=0.08,resistance:motor=2",
               "torque_constant:motor,resistance:motor", {0.1, 1.5}, 1e-3);
  expect_found(machine, "gear:motor=25,gain:push=0.2", "gear:motor,gain:push", {20, 0.3}, 1e-3);
}

// The scene's links are 1 m long; these parameters are differences from the scene.
TEST(RolloutParameters, LengthsOfLinksAndZerosOfEncoders) {
  const Machine machine("      all: {damping: 0.1}\n", "");
  expect_found(machine, "joint_z:elbow=0.03", "joint_z:elbow", {-0.03}, 1e-4);
  expect_found(machine, "joint_zero:elbow=0.05", "joint_zero:elbow", {-0.05}, 1e-4);
}

// A ball rolls down a plane that leans by 0.02 rad about its y axis; 0.1 mm of noise over 0.7 s, in
// which it rolls 34 mm, tells the angle to a few parts in a thousand. The tolerance is 1 %.
TEST(RolloutParameters, TiltOfTheGround) {
  const Scene level = test::ball_on_plane({});
  Experiment e{level, test::all_positions(level.model), {}, 1, {}, false, 0.01};
  e.map.free_body = 1;
  e.prediction.substeps = 2;
  e.recordings.push_back(record(with_settings(level, "tilt_y:ground=0.02"), 70, 2, 1e-4, 1));
  const Fit found = fit_rows(e, parse_parameters("tilt_y:ground", level));
  EXPECT_NEAR(found.parameters[0].value, 0.02, 2e-4);
}

// The centre of mass is told in the axes of the link's file, whatever the joint's axis.
TEST(RolloutParameters, CentresOfMassAreInAxesOfTheLink) {
  const Scene scene = load_scene(test::source_dir() + "/data/scenes/double_pendulum.yaml");
  const std::vector<Parameter> centre =
      parse_parameters("com_x:lower,com_y:lower,com_z:lower", scene);
  EXPECT_LT((parameter_values(centre, scene) - Vector3(0, 0, -0.5)).norm(), 1e-12);
  const Scene moved = with_settings(scene, "com_x:lower=0.1,com_z:lower=-0.7");
  Dynamics dynamics(moved.model);
  dynamics.set_configuration(VectorX::Zero(2));          // both links hang along -z
  const double mass = moved.model.body(1).inertia.mass;  // the same for both
  EXPECT_LT((dynamics.center_of_mass() - Vector3(0.05, 0, 0.5 * (-0.5 - 1.7))).norm(), 1e-12)
      << mass;
  const Scene turned = with_settings(scene, "spread_z:lower=2");
  const Matrix3& R =
      turned.model.frames()[static_cast<std::size_t>(turned.model.find_frame("lower"))]
          .X_BF.rotation;
  const Matrix3 before = R.transpose() * scene.model.body(2).inertia.rotational * R;
  const Matrix3 after = R.transpose() * turned.model.body(2).inertia.rotational * R;
  EXPECT_NEAR(after(2, 2), before(2, 2), 1e-12) << "stretched along z";
  EXPECT_NEAR(after(0, 0) - 0.5 * after(2, 2), 4.0 * (before(0, 0) - 0.5 * before(2, 2)), 1e-9);
}

}  // namespace
}  // namespace counterpoint::estimation::rollout_parameters_test
