// Scene parameters estimated together with the motions of noisy recordings.
#include "counterpoint/engine/estimate/parameter_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
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

// The motion of a free body does not depend on its mass: the estimate follows the prior, without
// interval.
TEST(ParameterEstimate, TellsWhatMotionsDoNotShow) {
  const ParameterEstimate found = estimate("mass", 1);
  EXPECT_FALSE(found.parameters.parameters[0].interval);
  // The prior holds the mass at the scene's value; noise shifts it by less than a tenth of the
  // range.
  EXPECT_NEAR(found.parameters.parameters[0].value, 1.0, 0.1);
}

TEST(ParameterEstimate, RefusesWhatTheSearchChangesItself) {
  for (const char* text : {"restitution", "smoothing", "size"})
    EXPECT_THROW(estimate(text, 1), InputError) << text;
  EXPECT_THROW(estimate("friction=0.6..0.9", 1), InputError) << "the scene has 0.5";
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
  const MotionPoint start{problem.measured, VectorX::Zero(2)};
  MotionFit fit(problem, start, 1);
  fit.free_parameters(true);
  constexpr double kStep = 1e-5;
  fit.begin(problem.options, start);
  fit.linearize();
  const VectorX gradient = fit.system().parameter_gradient();
  for (int k = 0; k < 2; ++k) {
    MotionPoint ahead = start, back = start;
    ahead.parameters[k] = kStep;
    back.parameters[k] = -kStep;
    fit.begin(problem.options, ahead);
    double difference = fit.cost();
    fit.begin(problem.options, back);
    difference -= fit.cost();
    EXPECT_GT(fit.cost(), 1.0);
    // Round-off of a cost of 1e3 over the step of a central difference, plus the step squared.
    EXPECT_NEAR(difference / (2.0 * kStep), gradient[k], 1e-7 * (1.0 + fit.cost()));
  }
}

}  // namespace
}  // namespace counterpoint::estimation::parameter_estimate_test
