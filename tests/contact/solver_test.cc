#include "counterpoint/contact/solver.h"

#include <gtest/gtest.h>

#include <limits>

#include "contact/random_problem.h"
#include "contact/rounding.h"
#include "contact/trials.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/thread_pool.h"

namespace counterpoint::contact::solver_test {
namespace {

using testing::exact_settings;
using testing::Random;
using testing::random_problem;
using testing::RandomOptions;

VectorX zero_start(const Problem& problem) { return VectorX::Zero(problem.num_velocities()); }

TEST(Solver, WithoutActiveConstraintOneStepIsEnough) {
  Random random(3);
  Solver solver;
  int seen = 0;
  for (int trial = 0; trial < 300; ++trial) {
    RandomOptions options;
    options.hard = true;
    options.only_cones = true;
    Problem problem = random_problem(random, options);
    for (int c = 0; c < problem.num_constraints(); ++c) {
      problem.law(c).bias.fill(0.0);
      problem.law(c).bias[0] = 1e3;  // gap as velocity, far away [m/s]
    }
    VectorX w(problem.num_velocities()), f;
    for (int i = 0; i < w.size(); ++i) w[i] = random.signed_unit();
    const Report& report = solver.solve(problem, Settings{}, w, f);
    EXPECT_EQ(report.status, Status::kConverged);
    EXPECT_LE(report.iterations, 1);
    EXPECT_EQ(f.cwiseAbs().sum(), 0.0);
    EXPECT_LT((w - problem.free_velocity()).norm(), 1e-14 * problem.free_velocity().norm());
    seen += problem.num_constraints();
  }
  EXPECT_GT(seen, 300);
}

// Islands are solved by any thread, in any order, to the same bits and the same report.
TEST(Solver, ThreadsChangeNothing) {
  Random random(4);
  ThreadPool pool(3);
  Solver one, many;
  many.use(&pool);
  int islands = 0;
  for (int trial = 0; trial < 200; ++trial) {
    RandomOptions options;
    options.max_blocks = 30;
    options.max_constraints = 20;
    options.coulomb = true;
    const Problem problem = random_problem(random, options);
    VectorX w1 = zero_start(problem), w2 = w1, f1, f2;
    const Report a = one.solve(problem, Settings{}, w1, f1);
    const Report b = many.solve(problem, Settings{}, w2, f2);
    EXPECT_EQ(w1, w2);
    EXPECT_EQ(f1, f2);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.total_iterations, b.total_iterations);
    EXPECT_EQ(a.line_search_evaluations, b.line_search_evaluations);
    EXPECT_EQ(a.residual, b.residual);
    EXPECT_EQ(a.residual_history, b.residual_history);
    islands += a.islands;
  }
  EXPECT_GT(islands, 400);  // two a problem
}

TEST(Solver, BlocksWithoutConstraintsFlyExactly) {
  Problem problem;
  problem.add_block(3);
  problem.mass(0).setIdentity();
  problem.free_velocity() << 0.1, 0.2, 0.3;
  VectorX w = VectorX::Ones(3), f;
  Solver solver;
  const Report& report = solver.solve(problem, Settings{}, w, f);
  EXPECT_EQ(report.status, Status::kConverged);
  EXPECT_EQ(report.iterations, 0);
  EXPECT_EQ(w, VectorX(problem.free_velocity()));
}

TEST(Solver, DenseAndSparseAgree) {
  Random random(5);
  Solver solver;
  for (const bool coulomb : {false, true}) {
    for (int trial = 0; trial < 200; ++trial) {
      RandomOptions options;
      options.coulomb = coulomb;
      options.max_blocks = 8;
      options.max_constraints = 12;
      options.compliance_low = 1e-3;
      options.smoothing_low = 1e-3;
      const Problem problem = random_problem(random, options);
      VectorX dense = zero_start(problem), sparse = dense, f_dense, f_sparse;
      Settings settings;
      settings.factorization = Factorization::kDense;
      if (!succeeded(solver.solve(problem, settings, dense, f_dense).status)) continue;
      settings.factorization = Factorization::kSparse;
      if (!succeeded(solver.solve(problem, settings, sparse, f_sparse).status)) continue;
      // Both are accurate to 1e-10 of the impulses; eps >= 1e-3 limits the resulting velocity
      // error.
      EXPECT_LT((dense - sparse).norm(), 1e-7 * (1 + dense.norm())) << trial;
    }
  }
}

TEST(Solver, IslandsSolvedApartAreTheWholeSolution) {
  Random random(6);
  Solver solver;
  for (int trial = 0; trial < 300; ++trial) {
    RandomOptions options;
    options.max_blocks = 8;
    options.compliance_low = 1e-3;
    options.smoothing_low = 1e-3;
    const Problem problem = random_problem(random, options);
    VectorX apart = zero_start(problem), whole = apart, f_apart, f_whole;
    Settings settings;
    EXPECT_TRUE(succeeded(solver.solve(problem, settings, apart, f_apart).status));
    settings.split_islands = false;
    EXPECT_TRUE(succeeded(solver.solve(problem, settings, whole, f_whole).status));
    EXPECT_LT((apart - whole).norm(), 1e-7 * (1 + apart.norm())) << trial;
  }
}

TEST(Solver, SameInputSameBits) {
  Random random(7);
  const Problem problem = random_problem(random, RandomOptions{});
  Solver used, fresh;
  VectorX w1 = zero_start(problem), w2 = w1, f1, f2;
  const Problem other = random_problem(random, RandomOptions{});
  VectorX w_other = zero_start(other), f_other;
  used.solve(other, Settings{}, w_other, f_other);  // leaves data in the scratch memory
  used.solve(problem, Settings{}, w1, f1);
  fresh.solve(problem, Settings{}, w2, f2);
  EXPECT_EQ(w1, w2);
  EXPECT_EQ(f1, f2);
}

TEST(Solver, ImpulsesAreTheInverseToTheBit) {
  Random random(8);
  Solver solver;
  for (int trial = 0; trial < 500; ++trial) {
    RandomOptions options;
    options.coulomb = random.coin();
    const Problem problem = random_problem(random, options);
    VectorX w = zero_start(problem), f, inverse;
    solver.solve(problem, exact_settings(), w, f);
    compute_impulse(problem, w, inverse);
    EXPECT_EQ(f, inverse);
  }
}

// Covers every law and dimension, mu 0 ... 10, masses 1 : 1e6, repeated constraints (A
// rank-deficient), approaching and separating velocities.
TEST(Solver, InverseReturnsWhatTheForwardStepUsed) {
  Random random(11);
  Solver solver;
  int failed[2] = {0, 0}, at_floor = 0, trials = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    RandomOptions options;
    options.mass_ratio = 1e6;
    options.max_friction = 10.0;
    options.compliance_low = 1e-4;
    options.hard = random.coin();
    options.coulomb = random.coin();
    const Problem problem = random_problem(random, options);
    VectorX w = zero_start(problem), f, inverse, pushed;
    const Report& report = solver.solve(problem, exact_settings(), w, f);
    ++trials;
    if (!succeeded(report.status)) {
      ++failed[options.coulomb];
      continue;
    }
    compute_impulse(problem, w, inverse);
    EXPECT_EQ(f, inverse);  // the same function gives the same bits
    // The residual of the equation of motion is the external impulse, zero here.
    const Residuals residuals = compute_residuals(problem, w, inverse);
    double rounding = 0.0;
    if (report.status == Status::kRoundoffFloor) {
      ++at_floor;
      rounding = testing::motion_rounding(problem, w);
    }
    // The report's scale adds 1e-4 of the momentum of w and w*.
    double momentum = 0.0;
    for (int b = 0; b < problem.num_blocks(); ++b) {
      const int start = problem.block_start(b), n = problem.block_size(b);
      const VectorX share =
          w.segment(start, n).cwiseAbs2() + problem.free_velocity().segment(start, n).cwiseAbs2();
      momentum += share.dot(problem.mass(b).diagonal());
    }
    EXPECT_LE(residuals.motion,
              1e-9 * (residuals.momentum_scale + 1e-4 * std::sqrt(momentum)) + rounding)
        << trial;
  }
  EXPECT_EQ(failed[0], 0);
  EXPECT_EQ(failed[1], 0);
  EXPECT_LE(at_floor, trials / 20);
  RecordProperty("failed_coulomb", failed[1]);
  RecordProperty("at_floor", at_floor);
}

TEST(Solver, SaysHowItFailed) {
  Random random(10);
  Solver solver;
  RandomOptions options;
  options.only_cones = true;
  Problem problem;
  do {
    problem = random_problem(random, options);
  } while (problem.num_constraints() < 3);
  VectorX w = zero_start(problem), f;
  Settings few;
  few.max_iterations = 1;  // also limits the steps with softer laws
  EXPECT_EQ(solver.solve(problem, few, w, f).status, Status::kMaxIterations);
  EXPECT_GT(solver.solve(problem, few, w, f).residual, few.tolerance);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  Problem broken = problem;
  broken.free_velocity()[0] = nan;
  EXPECT_EQ(solver.solve(broken, Settings{}, w, f).status, Status::kNotFinite);
  EXPECT_TRUE(w.allFinite());  // unchanged
  broken = problem;
  broken.law(0).smoothing = nan;
  EXPECT_EQ(solver.solve(broken, Settings{}, w, f).status, Status::kNotFinite);
  broken = problem;
  broken.jacobian(0, 0)(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(solver.solve(broken, Settings{}, w, f).status, Status::kNotFinite);
  broken = problem;
  broken.mass(problem.block(0, 0)).setZero();
  EXPECT_EQ(solver.solve(broken, Settings{}, w, f).status, Status::kSingular);
  broken = problem;
  broken.law(0).regularizer = 0.0;
  EXPECT_EQ(solver.solve(broken, Settings{}, w, f).status, Status::kInvalidLaw);
  broken = problem;
  broken.law(0).friction[0] = -0.1;
  EXPECT_EQ(solver.solve(broken, Settings{}, w, f).status, Status::kInvalidLaw);
}

}  // namespace
}  // namespace counterpoint::contact::solver_test
