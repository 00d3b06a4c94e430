// The solver with all its methods on thousands of hard problems, and the share of each method. The
// laws are never softened here: a solution exists (README.md), so every problem must be solved.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <string>

#include "contact/rounding.h"
#include "contact/trials.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::plan_test {
namespace {

using testing::exact_settings;
using testing::for_trials;
using testing::motion_rounding;
using testing::Random;
using testing::random_problem;
using testing::RandomOptions;

struct Family {
  const char* name;
  bool coulomb;
  bool wild;  ///< dense conflicting constraints, masses 1 : 1e6, mu to 10, eps from 1e-8
};

void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

RandomOptions plan_options(Random& random, bool coulomb, bool wild) {
  RandomOptions options;
  options.hard = random.coin();
  options.coulomb = coulomb;
  if (wild) {
    options.mass_ratio = 1e6;
    options.max_friction = 10.0;
    options.compliance_low = 1e-8;
  }
  return options;
}

class Plan : public ::testing::TestWithParam<Family> {};

TEST_P(Plan, SolvesRandomProblems) {
  const Family& family = GetParam();
  Solver solver;
  constexpr int kMethods = static_cast<int>(Method::kSofter) + 1;
  std::array<int, kMethods> solved{};
  int steps = 0, most = 0, unsolved = 0;
  std::string trials;
  for_trials(family.wild ? 11 : 1, 2000, [&](Random& random, int trial) {
    const Problem problem =
        random_problem(random, plan_options(random, family.coulomb, family.wild));
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    const Report& report = solver.solve(problem, exact_settings(), w, f);
    steps += report.iterations;
    most = std::max(most, report.iterations);
    if (!succeeded(report.status)) {
      ++unsolved;
      trials.append(" ").append(std::to_string(trial));
      return;
    }
    ++solved[static_cast<int>(report.method)];
    if (family.wild) return;  // forward_inverse_test.cc bounds round-off there
    const Residuals residuals = compute_residuals(problem, w, f);
    // Recomputed outside the solver. A result at the round-off floor is as exact as the round-off
    // of the velocities permits.
    EXPECT_LE(residuals.motion,
              1e-9 * (residuals.momentum_scale + 1e-4) +
                  (report.status == Status::kConverged ? 0.0 : motion_rounding(problem, w)));
  });
  for (int m = 0; m < kMethods; ++m) RecordProperty(method_name(static_cast<Method>(m)), solved[m]);
  RecordProperty("steps", steps);
  RecordProperty("most_steps", most);
  RecordProperty("unsolved", unsolved);
  EXPECT_EQ(unsolved, 0) << "trials" << trials;
}

INSTANTIATE_TEST_SUITE_P(Family, Plan,
                         ::testing::Values(Family{"convex", false, false},
                                           Family{"coulomb", true, false},
                                           Family{"wild_convex", false, true},
                                           Family{"wild_coulomb", true, true}),
                         [](const auto& test) { return std::string(test.param.name); });

// The 12,000 problems of six seeds in each Coulomb family, of which contact/README.md reports the
// unsolved. One extreme problem may stay unsolved: the continuation from softer laws turns back.
TEST(PlanOfSixSeeds, LeavesAtMostOneProblemUnsolved) {
  Solver solver;
  for (const bool wild : {false, true}) {
    int unsolved = 0, steps = 0;
    for (unsigned seed = 1; seed <= 6; ++seed) {
      for_trials(wild ? seed + 10 : seed, 2000, [&](Random& random, int) {
        const Problem problem = random_problem(random, plan_options(random, true, wild));
        VectorX w = VectorX::Zero(problem.num_velocities()), f;
        const Report& report = solver.solve(problem, exact_settings(), w, f);
        unsolved += !succeeded(report.status);
        steps += report.iterations;
      });
    }
    const std::string name = wild ? "wild_" : "";
    RecordProperty(name + "unsolved", unsolved);
    RecordProperty(name + "steps", steps);
    EXPECT_LE(unsolved, wild ? 1 : 0);
  }
}

// A rod sliding on its tip, so steep that pressing harder lifts the tip less than friction pulls it
// down (mu A_NT > A_NN). Without impulses, such a rigid contact has no solution or two (Painleve);
// a time step always has one, in which the rod jams.
TEST(Painleve, ContactsAreSolved) {
  int paradoxical = 0;
  for_trials(34, 500, [&](Random& random, int) {
    ContactSpaceProblem problem;
    const double nn = random.uniform(0.2, 1.0), tt = random.uniform(1.0, 4.0);
    const double nt = random.uniform(0.5, 0.95) * std::sqrt(nn * tt);
    problem.A.resize(3, 3);
    problem.A << nn, nt, 0.0, nt, tt, 0.0, 0.0, 0.0, tt;
    problem.c.resize(3);
    problem.c << random.signed_unit(), random.signed_unit() * 3.0, 0.1 * random.signed_unit();
    problem.mu = {random.uniform(0.2, 4.0)};
    paradoxical += problem.mu[0] * nt > nn;
    ContactSpaceOptions options;
    options.coulomb = true;
    const ContactSpaceSolution solution = solve_contact_space(problem, options, Settings{});
    EXPECT_TRUE(succeeded(solution.report.status));
    const auto residuals = contact_space_residuals(problem, solution.f, true);
    // The compliance changes the hard law by rho |f| with rho = max(mu, 0.1)^2 eps alpha, and |f|
    // is at most |c| over the smallest eigenvalue of A. The solver's residual, at its floor for
    // this compliance, changes v = c + A f by a share of A |f|. Factor 3: three products in the
    // complementarity, three terms in the scale of the residual.
    const auto eigenvalues = problem.A.selfadjointView<Eigen::Lower>().eigenvalues();
    const double mu = std::max(problem.mu[0], 0.1);
    const double rho = mu * mu * options.compliance * problem.A.trace() / 3.0;
    const double error = solution.report.residual * eigenvalues.maxCoeff();
    const double tolerance = 3.0 * (rho + error) / eigenvalues.minCoeff();
    EXPECT_LT(residuals.primal, tolerance);
    EXPECT_LT(residuals.dual, tolerance);
    EXPECT_LT(residuals.complementarity, tolerance);
  });
  EXPECT_GT(paradoxical, 200);
}

}  // namespace
}  // namespace counterpoint::contact::plan_test
