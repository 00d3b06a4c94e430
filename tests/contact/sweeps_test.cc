// Gauss-Seidel sweeps and their building blocks: factors along trees, responses to impulses.
#include "counterpoint/contact/solve/sweeps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact/linear_solution.h"
#include "contact/random_tree.h"
#include "contact/trials.h"
#include "counterpoint/contact/linear/limbs.h"
#include "counterpoint/contact/linear/tree_factor.h"

namespace counterpoint::contact::sweeps_test {
namespace {

using testing::any_friction;
using testing::backward_error;
using testing::dense_jacobian;
using testing::dense_mass;
using testing::for_islands;
using testing::Random;
using testing::random_vector;
using testing::RandomOptions;
using testing::Tree;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// Factors along the tree that Limbs finds in M; solving one or four at a time gives the same bits.
TEST(TreeFactor, SolvesAsDenseFactorsDo) {
  Random random(91);
  Limbs limbs;
  for (int trial = 0; trial < 200; ++trial) {
    const Tree tree = Tree::random(random, random.integer(1, 6), random.integer(0, 12));
    const int n = static_cast<int>(tree.parent.size());
    const RowMatrix mass = tree.mass(random);
    limbs.find(mass.data(), n);
    ASSERT_EQ(static_cast<int>(limbs.parents().size()), n);
    RowMatrix factors = mass;
    ASSERT_TRUE(factor_tree(limbs.parents().data(), n, factors.data()));
    const VectorX b = random_vector(random, n);
    VectorX x = b;
    solve_tree(limbs.parents().data(), n, factors.data(), x.data());
    // Backward error of Cholesky factorization: a small multiple of n round-offs.
    EXPECT_LT(backward_error(mass, x, b), 4.0 * n * kEpsilon);
    RowMatrix four = RowMatrix::Zero(n, 4);
    four.col(trial % 4) = b;
    solve_tree_four(limbs.parents().data(), n, factors.data(), four.data());
    for (int i = 0; i < n; ++i) EXPECT_EQ(four(i, trial % 4), x[i]);
  }
}

TEST(TreeFactor, RefusesWhatIsNotPositiveDefinite) {
  const int parent[] = {-1, 0};
  double singular[] = {1.0, 1.0, 1.0, 1.0};
  EXPECT_FALSE(factor_tree(parent, 2, singular));
  double unknown[] = {1.0, std::nan(""), std::nan(""), 1.0};
  EXPECT_FALSE(factor_tree(parent, 2, unknown));
}

// Compares J_c inv(M) J_c' and inv(M) J_c' f with dense matrices.
TEST(Responses, AreThoseOfDenseMatrices) {
  const auto usual = [](Random&) { return RandomOptions{}; };
  for_islands(92, 200, usual, [](Random& random, const Problem& problem, IslandSystem& island) {
    Responses responses;
    responses.reserve(island);
    ASSERT_TRUE(responses.begin(island));
    const MatrixX inverse = dense_mass(problem).inverse(), J = dense_jacobian(problem);
    // Blocks have condition numbers up to 1e4 (random_problem.h); entries are about one.
    constexpr double kTolerance = 1e-10;
    for (size_t i = 0; i < island.constraints().size(); ++i) {
      const auto& c = island.constraints()[i];
      const MatrixX Jc = J.middleRows(c.global_row, c.law.rows);
      const MatrixX own = Jc * inverse * Jc.transpose();
      const ConstMatrixMap found(responses.own(static_cast<int>(i)), c.law.rows, c.law.rows);
      EXPECT_LE((found - own).norm(), kTolerance * own.norm());
      const VectorX f = random_vector(random, c.law.rows);
      VectorX w = VectorX::Zero(island.size());
      responses.add(static_cast<int>(i), f.data(), w.data());
      VectorX global = VectorX::Zero(island.size());
      island.scatter(w.data(), global.data());
      const VectorX expected = inverse * Jc.transpose() * f;
      EXPECT_LE((global - expected).norm(), kTolerance * expected.norm());
    }
  });
}

MixedSystem mixed_system(IslandSystem& island) {
  MixedSystem system;
  system.reserve(island);
  system.begin(island, 1.0);
  return system;
}

Sweeps started(const IslandSystem& island, MixedSystem::Point& point) {
  Sweeps sweeps;
  sweeps.reserve(island);
  sweeps.begin(island);
  sweeps.start(point);
  return sweeps;
}

// For any laws, the velocity after sweeps is that of the impulses: momentum is conserved.
TEST(Sweeps, KeepMomentum) {
  for_islands(93, 300, any_friction, [](Random&, const Problem&, IslandSystem& island) {
    MixedSystem system = mixed_system(island);
    MixedSystem::Point point;
    point.w.assign(island.size(), 0.0);
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    system.guess(std::vector<double>(island.num_rows(), unknown), point.phi);
    Sweeps sweeps = started(island, point);
    sweeps.run(5, 0.0, 0.0, point);
    const double norm = system.residual(point), laws = std::sqrt(system.law_square());
    // The residual outside the laws is round-off of about ten sums, times the mass ratio of 1e4.
    EXPECT_LT(std::sqrt(std::max(0.0, norm * norm - laws * laws)),
              1e-7 * norm + 1e-10 * system.scale());
  });
}

// Without friction and smoothing, f >= 0 minimizes 1/2 f'(A + R)f + f'(J w* + b). Each visit
// approximately minimizes this over its own impulse (sigma >= A_cc), so the cost never rises and
// many sweeps converge.
TEST(Sweeps, DescendToTheSolutionWithoutFriction) {
  const auto choose = [](Random&) {
    RandomOptions options;
    options.only_type = LawType::kUnilateral;
    options.hard = true;
    options.mass_ratio = 10.0;
    // With a smaller compliance, redundant constraints take thousands of sweeps.
    options.compliance_low = options.compliance_high = 0.1;
    return options;
  };
  for_islands(94, 200, choose, [](Random&, const Problem& problem, IslandSystem& island) {
    const MatrixX inverse = dense_mass(problem).inverse(), J = dense_jacobian(problem);
    VectorX y = J * problem.free_velocity();
    MatrixX A = J * inverse * J.transpose();
    for (int c = 0; c < problem.num_constraints(); ++c) {
      const int row = problem.first_row(c);
      y[row] += problem.law(c).bias[0];
      A(row, row) += problem.law(c).regularizer;
    }
    MixedSystem system = mixed_system(island);
    MixedSystem::Point point;
    point.w.assign(island.size(), 0.0);
    point.phi.assign(island.num_rows(), 0.0);
    Sweeps sweeps = started(island, point);
    double before = 0.0;
    for (int sweep = 0; sweep < 2000; ++sweep) {
      sweeps.run(1, 0.0, 0.0, point);
      VectorX f(island.num_rows());
      for (const auto& c : island.constraints()) f[c.global_row] = point.phi[c.row];
      const double energy = f.dot(0.5 * (A * f) + y);
      ASSERT_LE(energy, before + 1e-12 * std::abs(before));  // round-off of the sums
      before = energy;
    }
    const double residual = system.residual(point);
    EXPECT_LT(residual, 1e-6 * system.scale());
  });
}

// Negligible changes are skipped, so a solution stays unchanged, to the bit.
TEST(Sweeps, LeaveASolutionAsItIs) {
  int tried = 0;
  for_islands(95, 400, any_friction, [&](Random&, const Problem& problem, IslandSystem& island) {
    // With smoothing, the widened law of dry friction is a different law (README.md, Laws).
    for (int c = 0; c < problem.num_constraints(); ++c)
      if (problem.law(c).type == LawType::kDryFriction && problem.law(c).smoothing > 0.0) return;
    ++tried;
    VectorX w = VectorX::Zero(problem.num_velocities()), f;
    Solver solver;
    if (!succeeded(solver.solve(problem, testing::exact_settings(), w, f).status)) return;
    std::vector<double> local(island.num_rows());
    for (const auto& c : island.constraints())
      std::copy_n(f.data() + c.global_row, c.law.rows, local.data() + c.row);
    MixedSystem system = mixed_system(island);
    MixedSystem::Point point;
    point.w.resize(island.size());
    island.gather(w.data(), point.w.data());
    system.guess(local, point.phi);
    system.residual(point);
    Sweeps sweeps = started(island, point);
    const auto phi = point.phi;
    sweeps.run(3, 0.0, 1e-4 * system.scale(), point);
    EXPECT_EQ(point.phi, phi);
  });
  EXPECT_GT(tried, 100);
}

}  // namespace
}  // namespace counterpoint::contact::sweeps_test
