// The planner of control: memory, threads, feedback, and a loop with a simulated world.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control.h"
#include "support/allocation_guard.h"
#include "support/paths.h"
#include "support/small_scenes.h"
#include "support/temp_folder.h"

namespace counterpoint::optimization::planner_test {
namespace {

ControlFile bundled(const std::string& name) {
  return load_control(std::filesystem::path(test::source_dir()) / "data/scenes/control" /
                      (name + ".yaml"));
}

/// Replans every interval from the plan's own states: a world that obeys the plan. Returns the
/// number of allocations in the last few replans.
std::size_t follow_itself(Planner& planner, double interval, int replans) {
  constexpr int kCounted = 5;
  VectorX q = planner.problem().start_q, v = planner.problem().start_v, u = v;
  std::size_t before = 0;
  for (int i = 0; i < replans; ++i) {
    if (i == replans - kCounted) before = test::allocation_count();
    planner.replan(i * interval, q, v);
    planner.sample((i + 1) * interval, q, v, u);
  }
  return test::allocation_count() - before;
}

// Lists of contacts grow until the motion has met all of its contacts.
TEST(Planner, DoesNotAllocateAfterWarmUp) {
  constexpr int kWarm = 150;
  for (const char* name : {"quadruped_walk", "humanoid_stand"}) {
    ControlFile file = bundled(name);
    file.planner.first_iterations = 3;
    Planner planner(file.file.problem, file.planner);
    EXPECT_EQ(follow_itself(planner, file.interval, kWarm), 0u) << name;
  }
}

TEST(Planner, IsTheSameToTheBitWithAnyNumberOfThreads) {
  std::vector<VectorX> last;
  for (const int threads : {1, 2, 3}) {
    ControlFile file = bundled("quadruped_walk");
    file.planner.threads = threads;
    file.planner.first_iterations = 3;
    Planner planner(file.file.problem, file.planner);
    follow_itself(planner, file.interval, 4);
    if (threads == 1) last = planner.frames();
    for (std::size_t t = 0; t < last.size(); ++t)
      EXPECT_EQ(planner.frames()[t], last[t]) << threads << " threads, frame " << t;
  }
}

// A state on the plan asks for the plan's own force; off it, for the force that leads back.
TEST(Planner, FeedbackLeadsBackToThePlan) {
  ControlFile file = bundled("quadruped_walk");
  file.planner.first_iterations = 3;
  const Model& model = *file.file.problem.model;
  Planner planner(file.file.problem, file.planner);
  planner.replan(0.0, file.file.problem.start_q, file.file.problem.start_v);
  VectorX q, v(model.nv()), planned(model.nv()), u(model.nv());
  planner.sample(0.03, q, v, planned);
  planner.force(0.03, file.gains, q, v, u);
  const int knee = model.body(model.find_joint("front_left_knee") + 1).v_index;
  const double limit = model.joint(model.find_joint("front_left_knee")).effort_limit;
  for (int i = 0; i < model.nv(); ++i) {
    const bool motor = file.file.problem.motors[static_cast<std::size_t>(i)] != 0;
    EXPECT_EQ(u[i], motor ? planned[i] : 0.0) << i;  // within the limits at rest
  }
  VectorX change = VectorX::Zero(model.nv());
  change[knee] = 0.01;
  const VectorX on_plan = q;
  integrate_configuration(model, on_plan, change, 1.0, q);
  planner.force(0.03, file.gains, q, v, u);
  EXPECT_NEAR(u[knee], planned[knee] - 0.01 * file.gains.stiffness[knee], 1e-9);
  change[knee] = 100.0;
  integrate_configuration(model, on_plan, change, 1.0, q);
  planner.force(0.03, file.gains, q, v, u);
  EXPECT_EQ(u[knee], -limit);
}

// Beyond its last frame the plan rests there.
TEST(Planner, ThePlanRestsBeyondItsEnd) {
  ControlFile file = bundled("quadruped_walk");
  file.planner.first_iterations = 3;
  Planner planner(file.file.problem, file.planner);
  planner.replan(0.0, file.file.problem.start_q, file.file.problem.start_v);
  VectorX q, v, u;  // resized
  planner.sample(0.06, q, v, u);
  EXPECT_EQ(v.size(), file.file.problem.model->nv());
  planner.sample(100.0, q, v, u);
  EXPECT_EQ(q, planner.frames().back());
  EXPECT_TRUE(v.isZero(0.0));
}

TEST(Planner, TermsAreCommandedByName) {
  ControlFile file = bundled("quadruped_walk");
  Planner planner(file.file.problem, file.planner);
  VectorX target = VectorX::Zero(file.file.problem.model->nv());
  planner.set_target("speed", target);
  EXPECT_THROW(planner.set_target("velocity of light", target), InputError);
  target.resize(1);
  EXPECT_THROW(planner.set_target("speed", target), InputError);
  // A term without a target in the file, which is then zero, is commanded as well.
  ControlFile stand = bundled("humanoid_stand");
  Planner standing(stand.file.problem, stand.planner);
  target.setConstant(stand.file.problem.model->nv(), 0.1);
  standing.set_target("speed", target);
  EXPECT_EQ(standing.problem().terms[4].target, target);
}

// A free ball of 1 kg is pulled by 2 N, of which the plan knows nothing: at first it predicts rest,
// later the true acceleration, up to exp(-1 s / 0.1 s) = 5e-5 of it.
TEST(Planner, LearnsAForceThatThePlanDoesNotKnow) {
  const Scene scene = test::free_ball({});
  Problem problem;
  problem.model = &scene.model;
  problem.options = scene.options;
  problem.options.time_step = 0.05;
  problem.steps = 4;
  problem.motors.assign(6, 0);
  problem.start_q = Simulator(scene).state().q;
  problem.start_v.setZero(6);
  problem.terms = {unactuated_condition(scene.model, problem.motors)};
  PlannerSettings settings;
  settings.disturbance_time = 0.1;
  Planner planner(problem, settings);
  constexpr double kForce = 2.0, kInterval = 0.02;
  VectorX q = problem.start_q, v = problem.start_v, planned_q = q, planned_v = v, u = v;
  for (int i = 0; i <= 50; ++i) {
    const double time = i * kInterval;
    q[0] = problem.start_q[0] + 0.5 * kForce * time * time;
    v[0] = kForce * time;
    planner.replan(time, q, v);
    planner.sample(time + problem.h(), planned_q, planned_v, u);
    if (i == 0) {
      EXPECT_NEAR(planned_v[0] - v[0], 0.0, 1e-9);
    }
  }
  EXPECT_NEAR((planned_v[0] - v[0]) / problem.h(), kForce, 1e-3 * kForce);
}

// The loop: a quadruped gets up, with masses and friction that the planner does not know, noise and
// a delay. The seed makes the run reproducible to the bit.
TEST(Control, AQuadrupedGetsUpInAWorldThatDiffersFromThePlans) {
  const ControlFile file = bundled("quadruped_up");
  const Scene world = scaled_world(*file.world, 1.1, 0.9);
  const WorldErrors errors{0.005, 1e-3, 1e-3};
  const ControlRun run = run_control(file, world, 3, errors);
  EXPECT_TRUE(run.success()) << run.error.front();
  const ControlRun again = run_control(file, world, 3, errors);
  EXPECT_EQ(run.end.q, again.end.q);
}

/// Largest speed of a joint [rad/s] in the last 0.2 s of a run from the plain start, which must
/// succeed.
double last_joint_speed(const ControlFile& file) {
  double speed = 0.0;
  ControlHooks hooks;
  hooks.step = [&](const State&, const Input&, double, const State& after, const StepReport&) {
    if (after.time > file.duration - 0.2)
      speed = std::max(speed, after.v.tail(after.v.size() - 6).cwiseAbs().maxCoeff());
  };
  EXPECT_TRUE(run_control(file, *file.world, 0, {}, hooks).success());
  return speed;
}

// Servos of the world follow the plan in place of the feedback, implicitly: with gains that an
// explicit feedback does not bear at the world's step of 1 ms (damping times step 100 times the
// inertia of a shank; its force jumps between the effort limits) the quadruped stands still.
TEST(Control, ServosOfTheWorldFollowThePlan) {
  const auto scenes = std::filesystem::path(test::source_dir()) / "data/scenes/control/scenes";
  ControlFile file = bundled("quadruped_stand");
  file.pushes.clear();
  file.duration = 1.0;
  const ControlFile plain = file;
  use_world(file, scenes / "quadruped_servos.yaml");
  EXPECT_TRUE(input_columns(file).targets);
  EXPECT_LT(last_joint_speed(file), 0.5);

  std::ifstream in(scenes / "quadruped_servos.yaml");
  std::string text(std::istreambuf_iterator<char>(in), {});
  const auto replace = [&text](const std::string& old, const std::string& with) {
    ASSERT_NE(text.find(old), std::string::npos) << old;
    text.replace(text.find(old), old.size(), with);
  };
  replace("../../..", (std::filesystem::path(test::source_dir()) / "data").string());
  replace("stiffness: 60, damping: 2", "stiffness: 30000, damping: 1000");
  const test::TempFolder folder;
  use_world(file, folder.write("stiff.yaml", text));
  EXPECT_LT(last_joint_speed(file), 0.5);
  file = plain;
  for (Eigen::Index k = 0; k < file.gains.stiffness.size(); ++k) {
    if (file.gains.stiffness[k] == 0.0) continue;
    file.gains.stiffness[k] = 30000;
    file.gains.damping[k] = 1000;
  }
  EXPECT_GT(last_joint_speed(file), 2.0);
}

TEST(Control, AWorldWithOtherCoordinatesIsRefused) {
  ControlFile file = bundled("spinner");
  EXPECT_THROW(use_world(file, std::filesystem::path(test::source_dir()) /
                                   "data/scenes/control/scenes/quadruped_servos.yaml"),
               InputError);
}

TEST(Control, AThreadOfItsOwnChangesNoBit) {
  ControlFile file = bundled("quadruped_walk");
  file.duration = 0.4;
  const WorldErrors errors{0.01, 1e-3, 1e-3};
  const ControlRun together = run_control(file, *file.world, 2, errors);
  file.own_thread = true;
  const ControlRun apart = run_control(file, *file.world, 2, errors);
  EXPECT_EQ(apart.end.q, together.end.q);
  EXPECT_EQ(apart.end.v, together.end.v);
}

TEST(Control, BundledProblemsLoad) {
  const auto folder = std::filesystem::path(test::source_dir()) / "data/scenes/control";
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    const ControlFile file = load_control(entry.path());
    EXPECT_FALSE(file.success.empty()) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 12);
}

// From their plain starts. A wheel without motor is turned; a box under friction comes to rest
// within 5 mm of its goal, which takes the estimate of forces that the plan does not know; a
// quadruped climbs 10 cm.
TEST(Control, PlansMakeAndBreakContacts) {
  for (const char* name : {"spinner", "push_box", "quadruped_step"}) {
    const ControlFile file = bundled(name);
    const ControlRun run = run_control(file, *file.world, 0, {});
    EXPECT_TRUE(run.success()) << name;
  }
}

}  // namespace
}  // namespace counterpoint::optimization::planner_test
