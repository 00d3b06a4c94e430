// Building blocks of plans: mirror images, standing poses, verification, velocity-dependent forces
// at the start of a step, feedback.
#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/feedback.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/optimize/settle.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"
#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::optimization::plan_test {
namespace {

const std::filesystem::path kProblems =
    std::filesystem::path(test::source_dir()) / "data/scenes/optimize";

TEST(Mirror, TwiceIsTheSame) {
  const Scene scene = load_scene(kProblems / "scenes/humanoid.yaml");
  const Mirror mirror = make_mirror(scene.model, "left_", "right_");
  for (int i = 0; i < scene.model.nv(); ++i) {
    const int j = mirror.v_index[static_cast<std::size_t>(i)];
    EXPECT_EQ(mirror.v_index[static_cast<std::size_t>(j)], i);
    EXPECT_EQ(mirror.v_sign[i], mirror.v_sign[j]);
  }
  EXPECT_THROW(make_mirror(scene.model, "left_", "wrong_"), InputError);
}

// Inverse dynamics commutes with the mirror image.
TEST(Mirror, ForcesOfTheMirrorImage) {
  const Scene scene = load_scene(kProblems / "scenes/humanoid.yaml");
  const Model& model = scene.model;
  const Mirror mirror = make_mirror(model, "left_", "right_");
  const auto image = [](const VectorX& x, const std::vector<int>& index, const VectorX& sign) {
    VectorX out(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i)
      out[i] = sign[i] * x[index[static_cast<std::size_t>(i)]];
    return out;
  };
  VectorX q = scene.q;
  q[2] = 0.8;
  integrate_configuration(model, q, test::random_vector(model.nv(), 1), 0.1, q);
  const VectorX v = test::random_vector(model.nv(), 2), w = test::random_vector(model.nv(), 3);
  Workspace workspace(model);
  Inverse inverse, of_image;
  step_inverse(model, scene.options, q, v, w, workspace, inverse);
  step_inverse(model, scene.options, image(q, mirror.q_index, mirror.q_sign),
               image(v, mirror.v_index, mirror.v_sign), image(w, mirror.v_index, mirror.v_sign),
               workspace, of_image);
  const VectorX expected = image(inverse.applied_force, mirror.v_index, mirror.v_sign);
  // Round-off of gaps, 1e-16 m, over compliance and step: 1e-9 of the largest force.
  EXPECT_LT((of_image.applied_force - expected).cwiseAbs().maxCoeff(), 1e-8 * inverse.force_scale);
}

TEST(Settle, ContactsCarryTheWeight) {
  const ProblemFile file = load_problem(kProblems / "quadruped.yaml");
  const Model& model = *file.problem.model;
  Workspace workspace(model);
  Inverse inverse;
  const VectorX rest = VectorX::Zero(model.nv());
  for (const double smoothing : {0.1, 1e-3, 1e-6}) {
    const SimulationOptions options = stage_at(file.problem, file.settings, smoothing).options;
    const VectorX q = settled(model, options, file.problem.motors, file.problem.start_q, workspace);
    step_inverse(model, options, q, rest, rest, workspace, inverse);
    EXPECT_LT(std::abs(inverse.applied_force[2]), 1e-6 * scene_weight(model)) << smoothing;
  }
}

// The pose is the same from above and from below the ground, where contacts push as well.
TEST(Settle, FindsTheGroundFromBelow) {
  test::BoxOnPlane box;
  const Scene scene = test::box_on_plane(box);
  Workspace workspace(scene.model);
  VectorX q = Simulator(scene).state().q;
  std::vector<double> heights;
  for (const double height : {-0.3, -0.05, 0.3}) {
    q[2] = height;
    heights.push_back(settled(scene.model, scene.options, motors_of(scene.model), q, workspace)[2]);
  }
  EXPECT_NEAR(heights[0], heights[2], 1e-9);
  EXPECT_NEAR(heights[1], heights[2], 1e-9);
}

/// Verifies a plan of two steps in which a box of 1 kg slides at `speed`, starting at a height
/// above the ground.
Verification verify_slide(double height, double speed, double friction) {
  test::BoxOnPlane box;
  box.friction = friction;
  box.height = height;
  Scene scene = test::box_on_plane(box);
  scene.options.time_step = 0.01;
  scene.options.contact.margin = 0.1;
  scene.options.contact.reach_acceleration = 1e9;
  Simulator simulator(scene);
  State state = simulator.state();
  state.v.setZero();
  state.v[0] = speed;
  if (height > 0.0) state.v[2] = -0.6 * height / scene.options.time_step;
  const VectorX v_0 = state.v;
  simulator.set_state(state);
  std::vector<VectorX> q = {state.q};
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(simulator.step().succeeded());
    q.push_back(simulator.state().q);
  }
  return verify(scene.model, scene.options, motors_of(scene.model), q, v_0);
}

// A box at 0.5 m/s on ground with friction 0.2 loses 0.2 g h per step and slips by 4.8 mm in the
// first step of 10 ms.
TEST(Verify, SlipOfWhatStands) {
  const Verification found = verify_slide(0.0, 0.5, 0.2);
  EXPECT_NEAR(found.stance_slip_max, 0.01 * (0.5 - 0.2 * 9.81 * 0.01), 1e-5);  // compliance
  EXPECT_EQ(found.landing_slip_max, 0.0);
  EXPECT_LT(found.forward_check_max, 1e-12);
}

// The box falls six tenths of the height in the first step and lands in the second.
TEST(Verify, SlipOfWhatLands) {
  const Verification found = verify_slide(0.02, 0.5, 0.2);
  EXPECT_EQ(found.stance_slip_max, 0.0);
  // It reaches the ground at the end of the step with the remaining distance over h as its speed;
  // friction takes 0.2 times the change of velocity.
  const double h = 0.01, g = 9.81, left = 0.4 * 0.02 - g * h * h;
  const double speed = 0.6 * 0.02 / h + 2.0 * g * h;
  EXPECT_NEAR(found.landing_slip_max, h * (0.5 - 0.2 * (speed - left / h)), 1e-6);  // compliance
  // Rounding of the speed over the compliance of 1e-6 at four contacts, on both sides of the check.
  EXPECT_LT(found.forward_check_max, h * 2.0 * 4.0 * 1.1e-16 * speed / 1e-6);
}

// With Coulomb friction a landing may have a second, distant solution. A forward step that starts
// from the plan's forces must stay at the plan's solution.
TEST(Verify, ForwardStepStartsAtThePlansForces) {
  const Scene scene = load_scene(kProblems / "scenes/hopper.yaml");
  Simulator simulator(scene);
  Workspace workspace(scene.model);
  Inverse inverse;
  int in_contact = 0;
  for (int i = 0; i < 60; ++i) {
    const State before = simulator.state();
    ASSERT_TRUE(simulator.step().succeeded());
    const State after = simulator.state();
    step_inverse(scene.model, scene.options, before.q, before.v, after.v, workspace, inverse);
    double load = 0.0;
    for (const ContactForce& c : inverse.contacts) load += c.force.dot(c.contact.normal);
    if (load < 1.0) continue;
    ++in_contact;
    State state{0.0, before.q, after.v, {}, memory_of(scene.model, before.q, inverse)}, next;
    state.v = before.v;
    Input input;
    input.applied_force = inverse.applied_force;
    step_forward(scene.model, scene.options, {}, state, input, workspace, next);
    EXPECT_LT((next.q - after.q).cwiseAbs().maxCoeff(), 1e-8) << i;
  }
  EXPECT_GT(in_contact, 5);
}

TEST(VelocityForces, AtTheStartAreInvertedToo) {
  for (int seed = 0; seed < 5; ++seed) {
    test::Random random(static_cast<std::uint64_t>(seed));
    Scene scene = test::make_random_scene(static_cast<std::uint64_t>(seed), {}, random);
    scene.options.time_step = 0.02;
    scene.options.mean_velocity_forces = false;
    Simulator simulator(scene);
    const VectorX force = test::random_vector(scene.model.nv(), 9);
    simulator.input().applied_force = force;
    const State before = simulator.state();
    ASSERT_TRUE(simulator.step().succeeded());
    const Inverse& inverse = simulator.inverse(before.q, before.v, simulator.state().v);
    // Without constraints only round-off remains (inverse_test.cc).
    EXPECT_LT((inverse.applied_force - force).cwiseAbs().maxCoeff(),
              1e-10 * std::max(1.0, inverse.force_scale));
  }
}

TEST(Feedback, BringsTheAcrobotBackToItsMotion) {
  const ProblemFile file = load_problem(kProblems / "acrobot.yaml");
  const Model& model = *file.problem.model;
  const Result plan = optimize(file.problem, file.guess, file.settings);
  ASSERT_EQ(plan.outcome, Outcome::kConverged);
  const Feedback feedback = compute_feedback(file.problem, file.settings, plan, {});
  EXPECT_EQ(feedback.missing, 0);
  const auto end_error = [&](bool with) {
    State state{0.0, plan.q[0], plan.v[0]}, next;
    state.q[0] += 1e-4;
    Workspace workspace(model);
    for (std::size_t t = 0; t < plan.applied_force.size(); ++t) {
      Input input;
      input.applied_force = following_force(model, plan.q[t], plan.v[t], plan.applied_force[t],
                                            with ? feedback.gains[t] : MatrixX(), state.q, state.v);
      step_forward(model, plan.options, {}, state, input, workspace, next);
      state = next;
    }
    return (state.q - plan.q.back()).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(end_error(true), 0.1 * end_error(false));
}

}  // namespace
}  // namespace counterpoint::optimization::plan_test
