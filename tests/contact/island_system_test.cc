// Limbs, and the linear algebra of an island against dense matrices.
#include "counterpoint/contact/solve/island_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "contact/linear_solution.h"
#include "contact/random_problem.h"
#include "contact/random_tree.h"
#include "counterpoint/contact/linear/limbs.h"
#include "support/allocation_guard.h"

namespace counterpoint::contact::island_system_test {
namespace {

using testing::backward_error;
using testing::dense_jacobian;
using testing::dense_mass;
using testing::Random;
using testing::random_vector;
using testing::RandomOptions;
using testing::Tree;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(Limbs, AreRunsWithoutBranchings) {
  Random random(73);
  Limbs limbs;
  for (int trial = 0; trial < 100; ++trial) {
    const Tree tree = Tree::random(random, 6, random.integer(0, 15));
    const int n = static_cast<int>(tree.parent.size());
    const RowMatrix mass = tree.mass(random);
    limbs.find(mass.data(), n);
    EXPECT_EQ(std::accumulate(limbs.sizes().begin(), limbs.sizes().end(), 0), n);
    std::vector<int> limb_of;
    for (size_t g = 0; g < limbs.sizes().size(); ++g)
      limb_of.insert(limb_of.end(), limbs.sizes()[g], static_cast<int>(g));
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < i; ++j) {
        const bool coupled = limb_of[i] == limb_of[j] ||
                             std::find(limbs.couples().begin(), limbs.couples().end(),
                                       std::pair(limb_of[i], limb_of[j])) != limbs.couples().end();
        EXPECT_EQ(coupled, tree.related(i, j)) << i << " " << j;
      }
    }
  }
}

// Trees with contacts, some between limbs, and free bodies: M + J'GJ against the dense matrix.
Problem random_trees(Random& random) {
  Problem problem;
  const int num_blocks = random.integer(1, 4);
  std::vector<Tree> trees;
  for (int b = 0; b < num_blocks; ++b) {
    trees.push_back(random.coin() ? Tree::random(random, 6, random.integer(0, 6))
                                  : Tree::random(random, random.integer(1, 6), 0));
    problem.add_block(static_cast<int>(trees[b].parent.size()));
    problem.mass(b) = trees[b].mass(random);
  }
  const int num_constraints = random.integer(1, 14);
  for (int c = 0; c < num_constraints; ++c) {
    const RandomOptions options;
    const LawType type = random.integer(0, 3) == 0 ? LawType::kUnilateral : LawType::kFrictionCone;
    const int a = random.integer(0, num_blocks - 1), b = random.integer(-1, num_blocks - 1);
    problem.add_constraint(testing::random_law(random, options, type), a, b);
    for (int side = 0; side < (b < 0 ? 1 : 2); ++side) {
      const int block = side == 0 ? a : b;
      auto jacobian = problem.jacobian(c, side);
      int i = random.integer(0, problem.block_size(block) - 1);
      for (; i >= 0; i = trees[block].parent[i])
        for (int r = 0; r < jacobian.rows(); ++r) jacobian(r, i) = random.signed_unit();
    }
  }
  for (int i = 0; i < problem.num_velocities(); ++i) problem.free_velocity()[i] = 0.1 * i;
  return problem;
}

struct LoadedIsland {
  IslandSystem system;
  std::vector<double> hessian;
  MatrixX matrix;

  void load(const Problem& problem, Factorization factorization) {
    std::vector<int> blocks(problem.num_blocks()), constraints(problem.num_constraints());
    std::iota(blocks.begin(), blocks.end(), 0);
    std::iota(constraints.begin(), constraints.end(), 0);
    system.load(problem, blocks, constraints, factorization);
  }
  // Draws G = B B' + skew (C - C'); some are zero.
  void choose_hessians(Random& random, const Problem& problem, double skew) {
    hessian.assign(system.hessian_size(), 0.0);
    const MatrixX jacobian = dense_jacobian(problem);
    matrix = dense_mass(problem);
    for (const auto& c : system.constraints()) {
      const int rows = c.law.rows;
      MatrixX root(rows, rows), other(rows, rows);
      for (int i = 0; i < rows * rows; ++i) {
        root.data()[i] = random.signed_unit();
        other.data()[i] = random.signed_unit();
      }
      MatrixX g = root * root.transpose() + skew * (other - other.transpose());
      g *= random.integer(0, 4) == 0 ? 0.0 : random.log_uniform(1e-2, 1e6);
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j < rows; ++j) hessian[c.hessian + i * rows + j] = g(i, j);
      const MatrixX j = jacobian.middleRows(c.global_row, rows);
      matrix += j.transpose() * g * j;
    }
  }
};

TEST(IslandSystem, SolvesWithTheDenseMatrix) {
  Random random(74);
  LoadedIsland island;
  for (int trial = 0; trial < 400; ++trial) {
    const Problem problem = random_trees(random);
    const double skew = trial % 2 == 0 ? 0.0 : random.uniform(0.0, 3.0);
    island.load(problem, trial % 5 == 0 ? Factorization::kDense : Factorization::kAutomatic);
    island.choose_hessians(random, problem, skew);
    const VectorX b = random_vector(random, problem.num_velocities());
    ASSERT_TRUE(island.system.factor(island.hessian.data(), skew > 0.0));
    VectorX x = b;
    island.system.solve(x.data());
    // Forming the matrix has a few round-offs per constraint.
    const double tolerance = 100.0 * problem.num_velocities() * kEpsilon;
    EXPECT_LT(backward_error(island.matrix, x, b), tolerance) << trial;
  }
}

// For any skew part of G: LU uses pivoting where its growth factor would exceed 1e5.
TEST(IslandSystem, StronglyUnsymmetricMatricesKeepTenDigits) {
  Random random(77);
  LoadedIsland island;
  for (int trial = 0; trial < 200; ++trial) {
    const Problem problem = random_trees(random);
    island.load(problem, Factorization::kAutomatic);
    island.choose_hessians(random, problem, random.log_uniform(1.0, 1e10));
    const VectorX b = random_vector(random, problem.num_velocities());
    if (!island.system.factor(island.hessian.data(), true)) continue;
    VectorX x = b;
    island.system.solve(x.data());
    EXPECT_LT(backward_error(island.matrix, x, b), 1e5 * problem.num_velocities() * kEpsilon)
        << trial;
  }
}

TEST(IslandSystem, ProductsAreThoseOfTheDenseJacobian) {
  Random random(75);
  LoadedIsland island;
  for (int trial = 0; trial < 200; ++trial) {
    const Problem problem = random_trees(random);
    island.load(problem, Factorization::kAutomatic);
    const MatrixX jacobian = dense_jacobian(problem);
    const int n = problem.num_velocities(), m = problem.num_rows();
    const VectorX x = random_vector(random, n), f = random_vector(random, m);
    VectorX y(m), out = x, bound(m), absolute = x;
    island.system.multiply_jacobian(x.data(), y.data());
    // The round-off of a sum of n terms is at most n units of the sum of magnitudes.
    const VectorX size = jacobian.cwiseAbs() * x.cwiseAbs();
    EXPECT_TRUE(((y - jacobian * x).cwiseAbs().array() <= n * kEpsilon * size.array()).all());
    const double square = island.system.add_impulse(f.data(), out.data());
    EXPECT_LT((out - x - jacobian.transpose() * f).cwiseAbs().maxCoeff(),
              m * kEpsilon * (1.0 + f.norm()) * 4.0);
    double expected = 0.0;
    for (const auto& c : island.system.constraints()) {
      const VectorX part = jacobian.middleRows(c.global_row, c.law.rows).transpose() *
                           f.segment(c.global_row, c.law.rows);
      for (int i = 0; i < n; ++i)
        expected += part[i] * part[i] * island.system.inverse_diagonal()[i];
    }
    EXPECT_NEAR(square, expected, 1e-13 * expected);
    const VectorX e = f.cwiseAbs();
    island.system.add_absolute(e.data(), absolute.data());
    EXPECT_LT((absolute - x - jacobian.cwiseAbs().transpose() * e).cwiseAbs().maxCoeff(),
              m * kEpsilon * (1.0 + f.norm()) * 4.0);
    island.system.velocity_roundoff(x.data(), bound.data());
    for (const auto& c : island.system.constraints()) {
      for (int r = 0; r < c.law.rows; ++r)
        EXPECT_NEAR(bound[c.row + r], kEpsilon * (size[c.row + r] + std::abs(c.law.bias[r])),
                    1e-13 * kEpsilon * (1.0 + size[c.row + r]));
    }
  }
}

TEST(IslandSystem, LoadingAndFactoringAgainAllocatesNothing) {
  if (!test::counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  Random random(76);
  std::vector<Problem> problems;
  for (int i = 0; i < 5; ++i) problems.push_back(random_trees(random));
  LoadedIsland island;
  std::vector<double> hessian(2000), x(2000);
  std::vector<int> blocks(20), constraints(20);
  std::iota(blocks.begin(), blocks.end(), 0);
  std::iota(constraints.begin(), constraints.end(), 0);
  std::size_t before = 0;
  for (int round = 0; round < 4; ++round) {
    if (round == 2) before = test::allocation_count();
    for (const Problem& problem : problems) {
      island.system.load(problem, std::span(blocks).first(problem.num_blocks()),
                         std::span(constraints).first(problem.num_constraints()),
                         Factorization::kAutomatic);
      for (const auto& c : island.system.constraints()) {
        // Strongly unsymmetric, so that pivoting is needed.
        for (int r = 0; r < c.law.rows; ++r)
          for (int s = 0; s < c.law.rows; ++s)
            hessian[c.hessian + r * c.law.rows + s] = r == s ? 1.0 : (r < s ? 1e9 : -1e9);
      }
      for (const bool unsymmetric : {true, false}) {
        if (!unsymmetric) std::fill(hessian.begin(), hessian.end(), 0.0);
        ASSERT_TRUE(island.system.factor(hessian.data(), unsymmetric));
        island.system.solve(x.data());
      }
    }
  }
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace counterpoint::contact::island_system_test
