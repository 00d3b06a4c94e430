// The methods behind the solver, each by itself: the mixed system's derivative, and the homotopy,
// which finds a solution of every Coulomb problem from anywhere.
#include "counterpoint/contact/homotopy.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>
#include <numeric>

#include "contact/random_problem.h"
#include "counterpoint/contact/contact_space.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/mixed_system.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {
namespace {

using testing::Random;
using testing::random_problem;
using testing::RandomOptions;

std::vector<int> all(int count) {
  std::vector<int> out(count);
  std::iota(out.begin(), out.end(), 0);
  return out;
}

// Along Newton's direction d the residual F(x + t d) is (1 - t) F(x) + O(t^2).
TEST(MixedSystem, DirectionZeroesTheLinearizedResidual) {
  Random random(31);
  for (int trial = 0; trial < 300; ++trial) {
    RandomOptions options;
    options.coulomb = random.coin();
    const Problem problem = random_problem(random, options);
    if (problem.num_constraints() == 0) continue;
    IslandSystem island;
    island.load(problem, all(problem.num_blocks()), all(problem.num_constraints()),
                Factorization::kAutomatic);
    MixedSystem system;
    system.begin(island);
    system.center = 1.0;  // smooth on the scale of the velocities, so that O(t^2) is small
    system.share = 0.5;
    MixedSystem::Point point, step;
    point.w.assign(island.free_velocity(), island.free_velocity() + island.size());
    system.guess(point.phi);
    for (double& x : point.phi) x *= 0.7;
    const double before = system.residual(point);
    if (!system.factor()) continue;  // a singular derivative: allowed for Coulomb laws
    system.direction(step);
    const double t = 1e-6 / (1.0 + std::sqrt(system.inner(step, step)));
    for (size_t i = 0; i < point.w.size(); ++i) point.w[i] += t * step.w[i];
    for (size_t i = 0; i < point.phi.size(); ++i) point.phi[i] += t * step.phi[i];
    const double after = system.residual(point);
    // Second order in t, and the rounding of both norms over t.
    EXPECT_NEAR((before - after) / (t * before), 1.0, 1e-2) << trial;
  }
}

TEST(Homotopy, AloneSolvesEveryRandomProblemFromZero) {
  Random random(33);
  Solver solver;
  Settings settings;
  settings.only = Method::kHomotopy;
  for (int trial = 0; trial < 1000; ++trial) {
    RandomOptions options;
    options.hard = random.coin();
    options.coulomb = trial % 2 == 1;
    const Problem problem = random_problem(random, options);
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    const Report& report = solver.solve(problem, settings, w, f);
    EXPECT_TRUE(succeeded(report.status))
        << trial << " " << status_name(report.status) << " " << report.residual;
  }
}

// A rod sliding on its tip, steep enough: pressing harder lifts it less than friction pulls it down
// (mu A_NT > A_NN). Rigid and without impulses such a contact has no solution, or two (Painleve); a
// time step always has one, which jams. Along the plain path of falling smoothing the Jacobian's
// determinant may change sign here.
TEST(Homotopy, SolvesPainleveContacts) {
  Random random(34);
  int paradoxical = 0;
  for (int trial = 0; trial < 500; ++trial) {
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
    for (const bool alone : {false, true}) {
      Settings settings;
      if (alone) settings.only = Method::kHomotopy;
      const ContactSpaceSolution solution = solve_contact_space(problem, options, settings);
      EXPECT_TRUE(succeeded(solution.report.status)) << trial << " " << alone;
      const auto residuals = contact_space_residuals(problem, solution.f, true);
      // The compliance moves the hard law by max(mu, 0.1)^2 eps alpha |f|, and |f| is at most |c|
      // over the least eigenvalue of A.
      const double least = problem.A.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff();
      const double mu = std::max(problem.mu[0], 0.1);
      const double tolerance =  // 3: three products in the complementarity
          1e-9 + 3.0 * mu * mu * options.compliance * problem.A.trace() / 3.0 / least;
      EXPECT_LT(residuals.primal, tolerance) << trial << " " << alone;
      EXPECT_LT(residuals.dual, tolerance) << trial << " " << alone;
      EXPECT_LT(residuals.complementarity, tolerance) << trial << " " << alone;
    }
  }
  EXPECT_GT(paradoxical, 200);
}

}  // namespace
}  // namespace counterpoint::contact
