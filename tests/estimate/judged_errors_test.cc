// Decision between white and slow errors of a recording, and the effect of contact smoothing on
// intervals.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counterpoint/engine/estimate/motion/motion_intervals.h"
#include "counterpoint/engine/estimate/motion/motion_priors.h"
#include "counterpoint/engine/estimate/motion/motion_result.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/paths.h"

namespace counterpoint::estimation::judged_errors_test {
namespace {

/// A cube that lands flat and slides to a stop.
Scene sliding_cube() {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/cube_toss.yaml");
  scene.options.effects.set(Effect::kSleeping, false);
  scene.options.effects.set(Effect::kRestitution, false);
  scene.q << 0.0, 0.0, 0.06, 1.0, 0.0, 0.0, 0.0;
  scene.v << 1.0, 0.3, 0.0, 0.0, 0.0, 0.0;
  return scene;
}

/// 50 rows at 100 Hz with white noise of standard deviation `noise` [m, rad].
Recording noisy_slide(const Scene& scene, double noise) {
  Simulator simulator(scene);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Recording out;
  out.file = "slide";
  out.q.resize(7, 50);
  out.v = out.applied_force = MatrixX::Zero(6, 50);
  for (int row = 0; row < 50; ++row) {
    VectorX by(6), q(7);
    for (double& x : by) x = noise * normal(random);
    integrate_configuration(scene.model, simulator.state().q, by, 1.0, q);
    out.q.col(row) = q;
    out.time.push_back(simulator.state().time);
    for (int k = 0; k < 5; ++k) EXPECT_TRUE(simulator.step().succeeded());
  }
  return out;
}

// No motor of a single free body can compensate the error of soft friction, so only the last,
// hardest stage of the continuation can judge the noise.
TEST(JudgedErrors, WhiteNoiseOfASlidingBodyIsSeenAsSuch) {
  const Scene scene = sliding_cube();
  const MotionEstimate estimate =
      estimate_motion(scene, test::all_positions(scene.model), noisy_slide(scene, 1e-3));
  EXPECT_EQ(estimate.errors, RecordingErrors::kWhite);
  // Chance autocorrelation of 50 rows is 0.14; the bound is four times that, over six coordinates.
  EXPECT_LT(estimate.residual_correlation.maxCoeff(), 0.57);
}

// A slow wave in the recorded positions leaves residuals that are correlated over many rows.
TEST(JudgedErrors, ResidualsOfSlowErrorsAreNotWhite) {
  const Scene scene = sliding_cube();
  Recording recording = noisy_slide(scene, 1e-3);
  for (int row = 0; row < recording.num_rows(); ++row)
    recording.q(2, row) += 3e-3 * std::sin(0.5 * row);  // 8 Hz, vertical
  MotionEstimateOptions options;
  options.errors = RecordingErrors::kWhite;
  const MotionEstimate estimate =
      estimate_motion(scene, test::all_positions(scene.model), recording, options);
  EXPECT_GT(estimate.residual_correlation[2], 0.57);
}

// Quadrupling the smoothing s changes a force by f(4 s) - f(s). If the error of the law is
// proportional to sqrt(s), the remaining change is as large, so intervals are widened by this
// change.
TEST(JudgedErrors, IntervalsHoldWhatIsLeftOfTheSmoothing) {
  const Scene scene = sliding_cube();
  const Recording recording = noisy_slide(scene, 0.0);
  const RecordedMotion recorded = prepare(scene.model, test::all_positions(scene.model), recording);
  const MotionProblem problem = motion_problem(
      scene, recorded, white_priors(scene, test::all_positions(scene.model), recorded));
  ContinuationResult found;
  found.smoothing = 1e-4;
  found.softer_smoothing = 4e-4;
  found.hardest.q = found.softer.q = recorded.frames;
  MotionEstimate out = empty_estimate(scene.model, recorded.time, with_links(scene.model, {}));
  out.force_deviation.setZero();
  widen_by_smoothing(problem, found, out);
  InstantModel instant(problem, scene.model);
  double most = 0.0;
  for (int t = 1; t + 1 < problem.frames(); ++t) {
    const VectorX soft =
        instant.invert(found.softer, stage_options(problem, 4e-4), t).applied_force;
    const VectorX hard =
        instant.invert(found.hardest, stage_options(problem, 1e-4), t).applied_force;
    const VectorX change = (soft - hard).cwiseAbs();
    EXPECT_LE((out.force_deviation.col(t) - change).cwiseAbs().maxCoeff(),
              1e-12 * (1.0 + change.maxCoeff()));
    most = std::max(most, change.maxCoeff());
  }
  EXPECT_GT(most, 0.01);  // [N]; the cube touches the ground

  // A single stage gives no information about the effect of smoothing.
  found.softer.q.clear();
  out.force_deviation.setConstant(2.0);
  widen_by_smoothing(problem, found, out);
  EXPECT_EQ(out.force_deviation.minCoeff(), 2.0);
  EXPECT_EQ(out.force_deviation.maxCoeff(), 2.0);
}

}  // namespace
}  // namespace counterpoint::estimation::judged_errors_test
