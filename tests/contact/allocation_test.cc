#include <gtest/gtest.h>

#include "contact/scenes.h"
#include "contact/trials.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/solver.h"
#include "support/allocation_guard.h"

namespace counterpoint::contact::allocation_test {
namespace {

TEST(Allocation, NoneAfterWarmUp) {
  if (!test::counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  for (const bool coulomb : {false, true}) {
    testing::SceneOptions options;
    options.coulomb = coulomb;
    const Problem problem = testing::make_stack(std::vector<double>(12, 1.0), 0.2, 0.5, options);
    Solver solver;
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    const VectorX start = w;
    solver.solve(problem, Settings{}, w, f);
    VectorX inverse = f;
    const std::size_t before = test::allocation_count();
    for (int i = 0; i < 5; ++i) {
      w = start;
      solver.solve(problem, Settings{}, w, f);
      compute_impulse(problem, w, inverse);
    }
    EXPECT_EQ(test::allocation_count(), before) << "coulomb " << coulomb;
  }
}

// Every method allocates its memory when an island of this size is first seen, although most
// islands need only the first two methods.
TEST(Allocation, NoneForMethodsThatAreSeldomTried) {
  if (!test::counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  int beyond_mixed = 0, softened = 0;
  testing::for_trials(1, 200, [&](testing::Random& random, int) {
    testing::RandomOptions options;
    options.mass_ratio = 1e8;
    options.coulomb = true;
    const Problem problem = testing::random_problem(random, options);
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    Solver solver;
    Settings settings;
    settings.only = Method::kVelocity;
    solver.solve(problem, settings, w, f);
    const std::size_t before = test::allocation_count();
    for (const int soften_after : {1, 20, Settings{}.soften_after}) {
      settings = {};
      settings.soften_after = soften_after;
      w.setZero();
      const Report& report = solver.solve(problem, settings, w, f);
      beyond_mixed += report.method > Method::kMixed;
      softened += report.status == Status::kSoftened;
    }
    for (const Method method : {Method::kMixed, Method::kSofter}) {
      settings.only = method;
      w.setZero();
      solver.solve(problem, settings, w, f);
    }
    EXPECT_EQ(test::allocation_count(), before);
  });
  EXPECT_GT(beyond_mixed, 100);
  EXPECT_GT(softened, 0);
}

TEST(Allocation, RefillingAProblemAllocatesNothing) {
  if (!test::counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  Problem problem;
  std::size_t before = 0;
  for (int round = 0; round < 3; ++round) {
    if (round == 1) before = test::allocation_count();
    problem.clear();
    for (int b = 0; b < 4; ++b) problem.add_block(6);
    for (int c = 0; c < 3; ++c) problem.add_constraint(Law{}, c, c + 1);
  }
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace counterpoint::contact::allocation_test
