// Softening where the given laws cannot be solved: the solver always returns the exact solution of
// laws that its report names. Islands that stop before they are solved.
#include <gtest/gtest.h>

#include "contact/trials.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/islands.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::softening_test {
namespace {

using testing::exact_settings;
using testing::for_trials;
using testing::Random;
using testing::random_problem;
using testing::RandomOptions;

/// Energy error at a relative impulse error of 1e-12 and mass ratios of 1e6.
constexpr double kEnergyRounding = 1e-9;

// Masses 1e-4 ... 1e4, friction up to 2.
Problem wild_problem(Random& random) {
  RandomOptions options;
  options.mass_ratio = 1e8;
  options.max_friction = 2.0;
  options.max_constraints = 12;
  options.hard = random.coin();
  options.coulomb = true;
  return random_problem(random, options);
}

// Returns the problem with its laws softened as the report states.
Problem softened(const Problem& problem, const Report& report) {
  Problem out = problem;
  Islands islands;
  islands.compute(problem, true);
  for (const auto& entry : report.softened) {
    int found = 0;
    for (int i = 0; i < islands.count(); ++i) {
      const auto blocks = islands.blocks(i);
      if (std::find(blocks.begin(), blocks.end(), entry.block) == blocks.end()) continue;
      ++found;
      for (const int c : islands.constraints(i))
        out.law(c) = soften(problem.law(c), entry.softness);
    }
    EXPECT_EQ(found, 1);
  }
  return out;
}

// The impulses are those of the softened laws, to the bit, and satisfy the momentum balance.
void expect_solution_of_softened_laws(const Problem& problem, const VectorX& w, const VectorX& f,
                                      const Report& report) {
  const Problem soft = softened(problem, report);
  VectorX inverse;
  compute_impulse(soft, w, inverse);
  EXPECT_EQ(f, inverse);
  const Residuals residuals = compute_residuals(soft, w, inverse);
  const VectorX root = testing::dense_mass(soft).diagonal().cwiseSqrt();
  const VectorX free = soft.free_velocity();
  const double share =
      kMomentumShare * std::hypot(root.cwiseProduct(w).norm(), root.cwiseProduct(free).norm());
  // Recomputes the report's residual; each island's scale is at most that of the whole problem.
  const double islands = std::max(1, report.islands);
  const double allowed = islands * (report.residual + 1e-14);
  EXPECT_LE(residuals.motion, allowed * (residuals.momentum_scale + share));
}

class Softening : public ::testing::TestWithParam<int> {};

TEST_P(Softening, NeverFailsAndSolvesTheLawsItNames) {
  Solver solver;
  Settings settings;
  settings.soften_after = GetParam();
  int softened_count = 0, worst = 0;
  for_trials(21, 2000, [&](Random& random, int) {
    const Problem problem = wild_problem(random);
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    const Report& report = solver.solve(problem, settings, w, f);
    EXPECT_TRUE(succeeded(report.status)) << status_name(report.status);
    EXPECT_EQ(report.status == Status::kSoftened, !report.softened.empty());
    for (const auto& entry : report.softened) {
      EXPECT_TRUE(entry.softness.any());
      EXPECT_GE(entry.softness.factor, 1.0);
    }
    softened_count += report.status == Status::kSoftened;
    worst = std::max(worst, report.iterations);
    expect_solution_of_softened_laws(problem, w, f, report);
  });
  ::testing::Test::RecordProperty("softened", softened_count);
  ::testing::Test::RecordProperty("most_steps", worst);
  const bool tiny_budget = GetParam() == 1;
  EXPECT_TRUE(!tiny_budget || softened_count > 0);  // otherwise nothing was tested
}

INSTANTIATE_TEST_SUITE_P(After, Softening, ::testing::Values(1, 20, Settings{}.soften_after),
                         ::testing::PrintToStringParamName());

TEST(NoSoftening, NeverSoftens) {
  Solver solver;
  for_trials(22, 500, [&](Random& random, int) {
    const Problem problem = wild_problem(random);
    Settings settings = exact_settings();
    for (const int most : {1, 10, Settings{}.max_iterations}) {
      settings.max_iterations = most;
      VectorX w = VectorX::Zero(problem.num_velocities()), f, inverse;
      const Report& report = solver.solve(problem, settings, w, f);
      EXPECT_NE(report.status, Status::kSoftened);
      EXPECT_TRUE(report.softened.empty());
      EXPECT_LE(report.iterations, most);
      compute_impulse(problem, w, inverse);  // given laws, solved or not
      EXPECT_EQ(f, inverse);
    }
  });
}

// The convex law f = -grad s(y) of a cone satisfies f'y <= 0. With biases b >= 0 in normal and 0 in
// tangential rows, w'M (w - w*) = f'(y - b) <= 0, so the energy is at most that of the free
// velocity. The given laws include biases that separate at up to 1 m/s.
TEST(Soften, GainsNoEnergy) {
  Solver solver;
  Settings settings;
  settings.soften_after = 1;
  int softened = 0, pushing = 0;
  for_trials(24, 500, [&](Random& random, int) {
    RandomOptions options;
    options.coulomb = options.hard = options.only_cones = true;
    options.mass_ratio = 1e6;
    Problem problem = random_problem(random, options);
    for (int c = 0; c < problem.num_constraints(); ++c) {
      Law& law = problem.law(c);
      std::fill(law.bias.begin() + 1, law.bias.end(), 0.0);
      pushing += law.bias[0] < 0.0;
    }
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    const Report& report = solver.solve(problem, settings, w, f);
    // Only problems with one island; other islands keep their own laws.
    if (report.status != Status::kSoftened || report.islands != 1) return;
    ++softened;
    const MatrixX M = testing::dense_mass(problem);
    const VectorX free = problem.free_velocity();
    EXPECT_LE(w.dot(M * w), free.dot(M * free) * (1.0 + kEnergyRounding));
  });
  EXPECT_GT(softened, 50);
  EXPECT_GT(pushing, 500);
}

/// Rounding of sums over some tens of rows and velocities, relative to the sum of their sizes.
constexpr double kRounding = 1e-12;

/// Sweeps skip changes of an impulse below 1.5e-8 of the island's momentum (negligible() in
/// island_solver.cc), here of 1e2 times as much for the lightest of masses 1e4 apart.
constexpr double kSkipped = 1.5e-6;

/// Expects impulses within the friction cones of a problem that has no other laws.
void expect_in_cones(const Problem& problem, const VectorX& f) {
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const Law& law = problem.law(c);
    const int row = problem.first_row(c);
    ASSERT_EQ(law.type, LawType::kFrictionCone);
    EXPECT_GE(f[row], 0.0);
    double square = 0.0;
    for (int r = 1; r < law.rows; ++r) {
      if (law.friction[r - 1] > 0.0) {
        square += f[row + r] * f[row + r] / (law.friction[r - 1] * law.friction[r - 1]);
      } else {
        EXPECT_EQ(f[row + r], 0.0);
      }
    }
    EXPECT_LE(std::sqrt(square), f[row] + kSkipped * f.lpNorm<Eigen::Infinity>());
  }
}

class Unfinished : public ::testing::TestWithParam<int> {};

// The impulses are in their cones and lead to the velocities, w = w* + inv(M) J'f. The kinetic
// energy is at most that of w* less the work of the biases, f'b: contacts give no energy of their
// own.
TEST_P(Unfinished, GainsNoEnergyAndTakesTheStepsGranted) {
  Solver solver, patient;
  Settings settings;
  settings.stop_after = GetParam();
  int unfinished = 0;
  for_trials(25, 1000, [&](Random& random, int) {
    RandomOptions options;
    options.coulomb = options.hard = options.only_cones = true;
    options.mass_ratio = 1e4;
    options.max_constraints = 12;
    const Problem problem = random_problem(random, options);
    VectorX w = VectorX::Zero(problem.num_velocities()), f, w_patient = w, f_patient;
    const Report& report = solver.solve(problem, settings, w, f);
    EXPECT_TRUE(succeeded(report.status)) << status_name(report.status);
    EXPECT_LE(report.iterations, GetParam());
    EXPECT_EQ(report.status == Status::kUnfinished, !report.unfinished.empty());
    EXPECT_TRUE(report.softened.empty());
    if (report.unfinished.empty()) {  // the same bits as without the bound
      patient.solve(problem, {}, w_patient, f_patient);
      EXPECT_EQ(w, w_patient);
      EXPECT_EQ(f, f_patient);
      return;
    }
    ++unfinished;
    if (report.islands != 1) return;  // solved islands have the residuals of Newton's method
    expect_in_cones(problem, f);
    const MatrixX M = testing::dense_mass(problem), J = testing::dense_jacobian(problem);
    const VectorX free = problem.free_velocity(), change = w - free;
    const double terms = (M.cwiseAbs() * (w.cwiseAbs() + free.cwiseAbs())).norm() +
                         (J.cwiseAbs().transpose() * f.cwiseAbs()).norm();
    VectorX b(problem.num_rows());
    for (int c = 0; c < problem.num_constraints(); ++c)
      for (int r = 0; r < problem.law(c).rows; ++r)
        b[problem.first_row(c) + r] = problem.law(c).bias[r];
    const double energy = 0.5 * w.dot(M * w), before = 0.5 * free.dot(M * free);
    EXPECT_LE((M * change - J.transpose() * f).norm(), kRounding * terms);
    EXPECT_LE(energy, before - f.dot(b) + kEnergyRounding * (before + std::abs(f.dot(b))));
  });
  EXPECT_GT(unfinished, GetParam() < 10 ? 100 : 0);
}

INSTANTIATE_TEST_SUITE_P(After, Unfinished, ::testing::Values(1, 4, 12),
                         ::testing::PrintToStringParamName());

TEST(Unfinished, IsNoAnswerWhereOnlySolutionsAreAllowed) {
  Solver solver;
  for_trials(26, 100, [&](Random& random, int) {
    const Problem problem = wild_problem(random);
    Settings settings = exact_settings();
    settings.stop_after = 1;
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    EXPECT_NE(solver.solve(problem, settings, w, f).status, Status::kUnfinished);
  });
}

TEST(Soften, ChangesRegularizerFrictionModelAndPushOnly) {
  for_trials(23, 200, [&](Random& random, int trial) {
    RandomOptions options;
    options.coulomb = true;
    Law law = random_law(random, options, testing::kEveryType[trial % 4]);
    law.regularizer = random.log_uniform(1e-6, 1.0);
    law.smoothing = random.uniform(0.0, 1.0);
    const Law soft = soften(law, {8.0, true});
    EXPECT_EQ(soft.regularizer, 8.0 * law.regularizer);
    EXPECT_FALSE(soft.coulomb);
    EXPECT_EQ(soft.smoothing, law.smoothing);
    EXPECT_EQ(soft.friction, law.friction);
    EXPECT_EQ(soft.bias[0], is_one_sided(law.type) ? std::max(law.bias[0], 0.0) : law.bias[0]);
    EXPECT_TRUE(std::equal(soft.bias.begin() + 1, soft.bias.end(), law.bias.begin() + 1));
    EXPECT_EQ(soften(law, {8.0, false}).bias, law.bias);
    EXPECT_EQ(soften(law, {}).regularizer, law.regularizer);
    EXPECT_EQ(soften(law, {}).coulomb, law.coulomb);
  });
}

}  // namespace
}  // namespace counterpoint::contact::softening_test
