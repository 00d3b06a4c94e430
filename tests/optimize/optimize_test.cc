// Problems with known answers, and the bundled problems from their plain initial guesses.
#include "counterpoint/engine/optimize/optimize.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/newton/newton.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::optimization::optimize_test {
namespace {

const std::filesystem::path kProblems =
    std::filesystem::path(test::source_dir()) / "data/scenes/optimize";

/// Required of a plan: step_forward reproduces it within 1e-8.
constexpr double kForward = 1e-8;

// A block moves on a slide from rest to rest in time T with the least sum of squared forces: the
// discrete minimum-energy motion, whose force falls linearly from +F to -F.
TEST(Optimize, BlockFromRestToRestWithLeastEffort) {
  const Scene scene = test::slider({});
  Problem problem;
  problem.model = &scene.model;
  problem.options = scene.options;
  problem.options.time_step = 0.05;
  problem.steps = 20;
  problem.motors = motors_of(scene.model);
  problem.start_q = VectorX::Zero(1);
  problem.start_v = VectorX::Zero(1);
  problem.goal_q = VectorX::Ones(1);
  problem.goal_v = VectorX::Zero(1);
  Term effort;
  effort.quantity = Quantity::kAppliedForce;
  effort.name = "effort";
  effort.weight = VectorX::Ones(1);
  problem.terms = {effort, unactuated_condition(scene.model, problem.motors)};
  Settings settings;
  settings.continuation.start = settings.continuation.end.emplace(1e-6);
  settings.tolerance = 1e-12;
  const Result result =
      optimize(problem, straight_line(scene.model, problem.start_q, *problem.goal_q, 20), settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  // u_t = a - b t: stationarity of the sum of squares under sum u = 0 and sum (N - t) u = const.
  for (std::size_t t = 1; t + 1 < result.applied_force.size(); ++t) {
    const double second = result.applied_force[t + 1][0] - 2.0 * result.applied_force[t][0] +
                          result.applied_force[t - 1][0];
    EXPECT_NEAR(second, 0.0, 1e-7) << t;  // forces are up to 6 N
  }
  EXPECT_NEAR(result.applied_force.front()[0], -result.applied_force.back()[0], 1e-7);
}

Result solve(const char* file, int threads, double smoothing, ProblemFile& problem,
             std::uint64_t seed = 0) {
  problem = load_problem(kProblems / file);
  Settings settings = problem.settings;
  settings.threads = threads;
  if (smoothing > 0.0) settings.continuation.end = smoothing;
  return optimize(problem.problem, seeded_guess(problem, seed), settings);
}

/// Solves a bundled problem down to its own last smoothing from the guess, then from random starts
/// until one converges; at most `starts` in all.
Result expect_plan(const char* file, std::uint64_t starts = 1) {
  ProblemFile problem;
  Result result = solve(file, 2, 0.0, problem);
  for (std::uint64_t seed = 1; seed < starts && result.outcome != Outcome::kConverged; ++seed)
    result = solve(file, 2, 0.0, problem, seed);
  EXPECT_EQ(result.outcome, Outcome::kConverged) << file;
  const double end =
      problem.settings.continuation.end.value_or(problem.problem.options.contact.smoothing);
  EXPECT_EQ(result.options.contact,
            stage_at(problem.problem, problem.settings, end).options.contact)
      << file;
  const Verification found = verify(*problem.problem.model, result.options, problem.problem.motors,
                                    result.q, result.v.front());
  EXPECT_LE(found.unactuated_max, 1e-3) << file;
  EXPECT_LE(found.overlap_max, 1e-4) << file;
  EXPECT_LE(found.cone_violation_max, 1e-9) << file;  // round-off of forces, relative to the weight
  EXPECT_LE(found.forward_check_max, kForward) << file;
  EXPECT_EQ(found.forward_failures, 0) << file;
  return result;
}

TEST(Optimize, AcrobotSwingsUp) { expect_plan("acrobot.yaml"); }
// The same swing-up in a time that is an unknown: with less weight on effort it is quicker.
TEST(Optimize, AcrobotSwingsUpInATimeOfItsChoice) {
  for (const std::uint64_t seed : {0, 1, 2}) {
    ProblemFile problem;
    const Result result = solve("acrobot_quick.yaml", 2, 0.0, problem, seed);
    EXPECT_EQ(result.outcome, Outcome::kConverged) << seed;
    const Verification found = verify(*problem.problem.model, result.options,
                                      problem.problem.motors, result.q, result.v.front());
    EXPECT_LE(found.unactuated_max, 1e-5) << seed;  // violation_tolerance
    EXPECT_LE(found.forward_check_max, kForward) << seed;
    EXPECT_LE(found.effort_max, 1.0) << seed;
    const double duration = result.options.time_step * problem.problem.steps;
    EXPECT_GT(duration, problem.problem.duration->least) << seed;
    EXPECT_LT(duration, problem.problem.duration->most) << seed;
    // At the optimum, stretching the motion does not pay; its cost of time is T^2 / 2.
    EXPECT_NEAR(result.cost_by_term[0], 0.5 * duration * duration, 1e-9) << seed;
  }
}
TEST(Optimize, HopperHops) { expect_plan("hopper.yaml"); }
TEST(Optimize, FingerTurnsAWheel) { expect_plan("spinner.yaml"); }
// Two thirds of the starts converge (docs/measurements/optimization.md); round-off decides which.
TEST(Optimize, FingerPushesABoxOverIce) { expect_plan("push_box.yaml", 4); }
TEST(Optimize, FingerPushesABoxOverARoughFloor) { expect_plan("rough_box.yaml", 2); }
TEST(Optimize, QuadrupedGetsUpFromItsBelly) {
  const Result result = expect_plan("quadruped_up.yaml", 2);
  EXPECT_LT(result.q.front()[2], 0.065);  // half the height of the trunk is 0.06 m
  EXPECT_GT(result.q.back()[2], 0.3);
}

// While nothing touches the ground, gravity and inertia alone move the body: there is a step
// without contact force. At 2 m/s a walk of the same stride exists, which has none.
TEST(Optimize, HumanoidRunsWithAFlightPhase) {
  const Result result = expect_plan("humanoid_run.yaml", 2);
  const ProblemFile file = load_problem(kProblems / "humanoid_run.yaml");
  const Model& model = *file.problem.model;
  Workspace workspace(model);
  Inverse inverse;
  int in_flight = 0;
  for (std::size_t t = 0; t + 1 < result.q.size(); ++t) {
    step_inverse(model, result.options, result.q[t], result.v[t], result.v[t + 1], workspace,
                 inverse);
    double load = 0.0;
    for (const ContactForce& contact : inverse.contacts) load += contact.force.norm();
    in_flight += load < 1e-9 * scene_weight(model) ? 1 : 0;
  }
  EXPECT_GE(in_flight, 1);
  EXPECT_LT(in_flight, 5);  // it lands within the 10 steps
}
TEST(Optimize, ArmRollsABall) { expect_plan("roll_ball.yaml", 4); }

TEST(Optimize, SameBitsWhateverTheThreads) {
  ProblemFile problem;
  const Result one = solve("acrobot.yaml", 1, 1e-2, problem);
  const Result three = solve("acrobot.yaml", 3, 1e-2, problem);
  ASSERT_EQ(one.q.size(), three.q.size());
  EXPECT_EQ(one.iterations, three.iterations);
  for (std::size_t t = 0; t < one.q.size(); ++t) EXPECT_EQ(one.q[t], three.q[t]) << t;
}

TEST(Optimize, AStepOfEveryBundledProblemLowersItsCost) {
  int problems = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kProblems)) {
    if (entry.path().extension() != ".yaml") continue;
    ++problems;
    const ProblemFile file = load_problem(entry.path());
    Newton newton(file.problem, file.guess, 2);
    newton.begin(stage_at(file.problem, file.settings, file.settings.continuation.start));
    const double before = newton.cost();
    const Iteration step = newton.iterate();
    EXPECT_TRUE(step.accepted) << entry.path();
    EXPECT_LT(newton.cost(), before) << entry.path();
  }
  EXPECT_GE(problems, 6);
}

TEST(Optimize, StopsWhenToldTo) {
  ProblemFile problem = load_problem(kProblems / "acrobot.yaml");
  Settings settings = problem.settings;
  settings.progress = [](const Progress& p) { return p.iteration < 3; };
  const Result result = optimize(problem.problem, problem.guess, settings);
  EXPECT_EQ(result.outcome, Outcome::kStopped);
  EXPECT_EQ(result.iterations, 3);
}

}  // namespace
}  // namespace counterpoint::optimization::optimize_test
