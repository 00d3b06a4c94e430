// A warm start from given impulses saves iterations and changes nothing else.
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "contact/scenes.h"
#include "contact/trials.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::warm_start_test {
namespace {

using testing::exact_settings;
using testing::for_trials;
using testing::Random;
using testing::random_problem;
using testing::RandomOptions;

Settings warm_settings() {
  Settings settings = exact_settings();
  settings.warm = true;
  return settings;
}

VectorX zero_start(const Problem& problem) { return VectorX::Zero(problem.num_velocities()); }

TEST(WarmStart, AtTheSolutionTakesNoStep) {
  Solver solver;
  for_trials(9, 400, [&](Random& random, int) {
    RandomOptions options;
    options.hard = random.coin();
    options.coulomb = random.coin();
    const Problem problem = random_problem(random, options);
    VectorX w = zero_start(problem), f;
    if (solver.solve(problem, exact_settings(), w, f).status != Status::kConverged) return;
    EXPECT_EQ(solver.solve(problem, exact_settings(), w, f).iterations, 0);
    EXPECT_EQ(solver.solve(problem, warm_settings(), w, f).iterations, 0);
  });
}

// The problem one step later: the free velocity has changed by a tenth. Compares a warm start with
// a start from zero and with a start from the last velocity without impulses.
TEST(WarmStart, NeighbouringProblemsTakeFewerStepsThanCold) {
  Solver solver;
  int cold = 0, velocity_only = 0, warm = 0;
  for_trials(11, 1000, [&](Random& random, int) {
    RandomOptions options;
    options.hard = random.coin();
    options.coulomb = random.coin();
    Problem problem = random_problem(random, options);
    VectorX w = zero_start(problem), f;
    if (!succeeded(solver.solve(problem, exact_settings(), w, f).status)) return;
    constexpr double kChange = 0.1;
    for (int i = 0; i < w.size(); ++i) problem.free_velocity()[i] += kChange * random.signed_unit();
    VectorX last = w, zero = zero_start(problem), ignored = f;
    cold += solver.solve(problem, exact_settings(), zero, ignored).iterations;
    velocity_only += solver.solve(problem, exact_settings(), last, ignored).iterations;
    warm += solver.solve(problem, warm_settings(), w, f).iterations;
  });
  ::testing::Test::RecordProperty("cold_steps", cold);
  ::testing::Test::RecordProperty("velocity_only_steps", velocity_only);
  ::testing::Test::RecordProperty("warm_steps", warm);
  EXPECT_LT(warm, cold);
  EXPECT_LT(warm, velocity_only);
}

// A convex problem has one solution, also from guessed impulses: its own or arbitrary ones.
TEST(WarmStart, GuessesDoNotChangeTheSolutionWhereItIsUnique) {
  Solver solver;
  for_trials(12, 500, [&](Random& random, int) {
    RandomOptions options;
    options.compliance_low = 1e-3;
    options.smoothing_low = 1e-3;
    const Problem problem = random_problem(random, options);
    VectorX w = zero_start(problem), f;
    ASSERT_TRUE(succeeded(solver.solve(problem, exact_settings(), w, f).status));
    for (const bool own : {true, false}) {
      VectorX guessed = zero_start(problem), f_guessed = f;
      for (int i = 0; i < f.size() && !own; ++i) f_guessed[i] = 3.0 * random.signed_unit();
      EXPECT_TRUE(succeeded(solver.solve(problem, warm_settings(), guessed, f_guessed).status));
      // Both are accurate to 1e-12 of the impulses; eps >= 1e-3 limits the resulting velocity
      // error.
      EXPECT_LT((guessed - w).norm(), 1e-7 * (1 + w.norm())) << own;
    }
  });
}

TEST(WarmStart, NotANumberIsNoGuess) {
  Solver solver;
  for_trials(13, 300, [&](Random& random, int) {
    RandomOptions options;
    options.coulomb = random.coin();
    const Problem problem = random_problem(random, options);
    VectorX w = zero_start(problem), f = VectorX::Constant(problem.num_rows(), 7.0);
    const int steps = solver.solve(problem, exact_settings(), w, f).iterations;
    VectorX same = zero_start(problem), f_same = f;
    for (int c = 0; c < problem.num_constraints(); ++c)
      f_same[problem.first_row(c)] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(solver.solve(problem, warm_settings(), same, f_same).iterations, steps);
    EXPECT_EQ(same, w);
    EXPECT_EQ(f_same, f);
  });
}

// Typical for the engine: a tower at rest with a small disturbance.
TEST(WarmStart, TowerAtRestTakesNoMoreStepsThanCold) {
  Solver solver;
  for (const bool coulomb : {false, true}) {
    testing::SceneOptions options;
    options.coulomb = coulomb;
    Problem problem = testing::make_stack(std::vector<double>(10, 1.0), 0.2, 0.5, options);
    VectorX w = zero_start(problem), f;
    ASSERT_TRUE(succeeded(solver.solve(problem, exact_settings(), w, f).status));
    problem.free_velocity()[6 * 9] += 1e-3;  // pushes the top box
    VectorX cold = w, f_cold;
    const int without = solver.solve(problem, exact_settings(), cold, f_cold).iterations;
    EXPECT_LE(solver.solve(problem, warm_settings(), w, f).iterations, without);
    constexpr double kUnique = 1e-9;  // [m/s]; nothing slips, so the velocity is unique
    EXPECT_LT((w - cold).norm(), kUnique);
  }
}

// Gauss-Seidel sweeps need a number proportional to the levels; Newton's method does not.
TEST(ColdStart, HundredLevelsTakeFarFewerStepsThanLevels) {
  constexpr int kLevels = 100, kMost = kLevels / 3;
  Solver solver;
  for (const double smoothing : {0.0, 1e-9, 1e-6}) {
    for (const bool coulomb : {false, true}) {
      testing::SceneOptions options;
      options.coulomb = coulomb;
      options.smoothing = smoothing;
      for (const int levels : {1, 10, 30, kLevels}) {
        const std::vector<double> masses(static_cast<size_t>(levels), 1.0);
        const Problem problem = testing::make_stack(masses, 0.2, 0.5, options);
        VectorX w = zero_start(problem), f;
        const Report& report = solver.solve(problem, exact_settings(), w, f);
        EXPECT_TRUE(succeeded(report.status)) << levels << " levels, smoothing " << smoothing;
        EXPECT_LE(report.iterations, kMost) << levels << " levels, smoothing " << smoothing;
        ::testing::Test::RecordProperty(
            std::string(coulomb ? "coulomb" : "convex") + "_steps_of_" + std::to_string(levels) +
                "_at_" + std::to_string(static_cast<int>(1e9 * smoothing)) + "_nm",
            report.iterations);
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::contact::warm_start_test
