// Parameters found by predictions of noisy recordings whose truth is known.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::rollout_parameters_test {
namespace {

/// Records a simulation of the scene every `substeps` steps, with white noise on positions [m],
/// five times as large on angles [rad].
Recording record(const Scene& scene, int rows, int substeps, double noise, unsigned seed) {
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

}  // namespace
}  // namespace counterpoint::estimation::rollout_parameters_test
