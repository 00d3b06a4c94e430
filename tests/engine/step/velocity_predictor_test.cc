// The predicted velocity alone: that of a step which (q, w) determines.
#include "counterpoint/engine/forces/velocity_predictor.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "support/linkages.h"
#include "support/random_model.h"

namespace counterpoint::velocity_predictor_test {
namespace {

/// Rounding of two articulated-body passes through the same tree, relative to the velocity.
constexpr double kRounding = 1e-13;
/// Closures and mimic joints: the step solves them by contact::Solver to 1e-12 of the impulses, the
/// predictor by a factorization. Both round J inv(M) J' + R, with a condition of up to 1 / eps.
constexpr double kEqualities = 1e-9;

/// Returns the predictor of `workspace` after the inverse of a step from (q, v).
const VelocityPredictor& predict(const Scene& scene, Workspace& workspace) {
  Inverse out;
  step_inverse(scene.model, scene.options, scene.q, scene.v, scene.v, workspace, out);
  return workspace.impl().start.predictor();
}

/// Velocity after a step without input, with velocity-dependent forces taken at its start.
VectorX step_without_prediction(const Scene& scene) {
  SimulationOptions options = scene.options;
  options.mean_velocity_forces = false;
  Workspace workspace(scene.model);
  const State state{0.0, scene.q, scene.v, {}};
  State next = state;
  Input input;
  input.applied_force = VectorX::Zero(scene.model.nv());
  const StepReport report =
      step_forward(scene.model, options, contact::Settings(), state, input, workspace, next);
  EXPECT_TRUE(report.succeeded());
  return next.v;
}

/// Returns the largest relative difference of the first pass from such a step over the covered
/// trees, except for linear velocities of floating bases; adds the number of covered trees to
/// `covered`.
double error_of_first_pass(const Scene& scene, int& covered) {
  Workspace workspace(scene.model);
  const VelocityPredictor& predictor = predict(scene, workspace);
  const VectorX& predicted =
      predictor.refined() ? predictor.first_velocity() : predictor.velocity();
  const VectorX step = step_without_prediction(scene);
  double worst = 0.0;
  for (int t = 0; t < scene.model.num_trees(); ++t) {
    if (!predictor.covers(t)) continue;
    ++covered;
    const Tree& tree = scene.model.trees()[t];
    const int size = tree.v_end - tree.v_begin;
    VectorX difference = predicted.segment(tree.v_begin, size) - step.segment(tree.v_begin, size);
    // A step corrects this velocity for momentum (free_groups.h).
    if (scene.model.body(tree.body_begin).joint_type == JointType::kFloating)
      difference.head<3>().setZero();
    worst = std::max(worst, difference.norm() / (1.0 + step.norm()));
  }
  return worst;
}

TEST(VelocityPredictor, IsTheStepThatNothingDrives) {
  int covered = 0;
  double worst = 0.0;
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.damping = options.armature = options.springs = seed % 2 == 0;
    options.compensations = seed % 3 == 0;
    options.base = seed % 2 == 0 ? Base::kFixed : Base::kFloating;
    const Scene scene = test::make_random_scene(seed, options, random);
    const double error = error_of_first_pass(scene, covered);
    EXPECT_LT(error, kRounding) << "seed " << seed;
    worst = std::max(worst, error);
  }
  RecordProperty("error", testing::PrintToString(worst));
  EXPECT_GT(covered, 15);
}

TEST(VelocityPredictor, IsThatStepWithMimicJointsAndClosures) {
  int covered = 0;
  double worst = 0.0;
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.mimics = seed % 2 == 0;
    options.closures = seed % 2;
    const Scene scene = test::make_random_scene(seed, options, random);
    const double error = error_of_first_pass(scene, covered);
    EXPECT_LT(error, kEqualities) << "seed " << seed;
    worst = std::max(worst, error);
  }
  Scene four_bar{"four_bar", test::make_four_bar({}), {}, {}, {}};
  four_bar.q = four_bar.model.default_q();
  four_bar.v = VectorX::Constant(four_bar.model.nv(), 0.5);
  EXPECT_LT(error_of_first_pass(four_bar, covered), kEqualities);
  RecordProperty("error", testing::PrintToString(worst));
  EXPECT_GT(covered, 15);
}

TEST(VelocityPredictor, CoversNoTreeThatSomethingUnknownHolds) {
  for (int seed = 0; seed < 10; ++seed) {
    for (const bool servos : {true, false}) {
      test::Random random(seed);
      test::RandomModelOptions options;
      options.servos = servos;
      options.dry_friction = !servos;
      const Scene scene = test::make_random_scene(seed, options, random);
      Workspace workspace(scene.model);
      const VelocityPredictor& predictor = predict(scene, workspace);
      for (int t = 0; t < scene.model.num_trees(); ++t)
        EXPECT_FALSE(predictor.covers(t)) << "seed " << seed;
    }
  }
}

// A tree at rest needs no prediction: its velocity-dependent forces are zero.
TEST(VelocityPredictor, CoversNoTreeAtRestThoughItKnowsAllThatActs) {
  test::Random random(1);
  Scene scene = test::make_random_scene(1, {}, random);
  scene.v.setZero();
  Workspace workspace(scene.model);
  const VelocityPredictor& predictor = predict(scene, workspace);
  EXPECT_FALSE(predictor.covers(0));
  EXPECT_TRUE(predictor.knows(0));
}

}  // namespace
}  // namespace counterpoint::velocity_predictor_test
