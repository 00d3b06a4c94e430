// Linear systems with the sparsity of trees, and dense ones.
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::sparse_solve_test {
namespace {

/// Bound of the residual of random well-conditioned systems: rounding times their condition number.
constexpr double kTolerance = 1e-10;

/// A random matrix whose entries couple ancestors and descendants of a tree: symmetric positive
/// definite, or unsymmetric.
MatrixX tree_matrix(int n, bool symmetric, test::Random& random) {
  std::vector<int> parent(static_cast<std::size_t>(n), -1);
  for (int i = 1; i < n; ++i)
    parent[static_cast<std::size_t>(i)] = random.integer(std::max(0, i - 4), i - 1);
  MatrixX A = MatrixX::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    A(i, i) = n * random.uniform(1.0, 2.0);
    for (int j = parent[static_cast<std::size_t>(i)]; j >= 0;
         j = parent[static_cast<std::size_t>(j)]) {
      A(i, j) = random.uniform(-1.0, 1.0);
      A(j, i) = symmetric ? A(i, j) : random.uniform(-1.0, 1.0);
    }
  }
  return A;
}

MatrixX random_matrix(int rows, int columns, test::Random& random) {
  MatrixX B(rows, columns);
  for (double& x : B.reshaped()) x = random.uniform(-1.0, 1.0);
  return B;
}

void expect_solved(const MatrixX& A, const MatrixX& B, SparseSolver& solver) {
  const int n = static_cast<int>(A.rows()), columns = static_cast<int>(B.cols());
  solver.begin(A, columns + n);
  solver.add(B, 0, -2.0);
  solver.add_identity(columns);
  ASSERT_TRUE(solver.solve());
  MatrixX X(n, columns), inverse(n, n);
  solver.get(0, X);
  solver.get(columns, inverse);
  EXPECT_LE((A * X + 2.0 * B).lpNorm<Eigen::Infinity>(), kTolerance) << n << " " << columns;
  EXPECT_LE((A * inverse - MatrixX::Identity(n, n)).lpNorm<Eigen::Infinity>(), kTolerance)
      << n << " " << columns;
}

TEST(SparseSolver, SolvesTreesOfEverySize) {
  test::Random random(1);
  SparseSolver solver;
  for (int n = 1; n < 40; ++n)
    expect_solved(tree_matrix(n, n % 2 == 0, random), random_matrix(n, 1 + n % 19, random), solver);
}

TEST(SparseSolver, ExchangesRowsWherePivotsVanish) {
  test::Random random(2);
  SparseSolver solver;
  for (int n = 2; n < 30; ++n) {
    // Rows in reverse order move every pivot; then a dense matrix has a zero diagonal.
    const MatrixX A = tree_matrix(n, false, random).colwise().reverse();
    expect_solved(A, random_matrix(n, 3, random), solver);
    MatrixX dense = random_matrix(n, n, random) + 3.0 * MatrixX::Identity(n, n).rowwise().reverse();
    dense.diagonal().setZero();
    if (std::abs(dense.determinant()) > 1e-3)
      expect_solved(dense, random_matrix(n, 2, random), solver);
  }
}

TEST(SparseSolver, SaysWhenThereIsNoSolution) {
  SparseSolver solver;
  const MatrixX A = MatrixX::Zero(3, 3);
  solver.begin(A, 3);
  solver.add_identity(0);
  EXPECT_FALSE(solver.solve());
}

TEST(SparseSolver, AllocatesNothingOnceSizesHaveBeenSeen) {
  test::Random random(3);
  SparseSolver solver;
  const MatrixX A = tree_matrix(23, true, random), B = random_matrix(23, 7, random);
  MatrixX X(23, 7);
  const auto solve = [&] {
    solver.begin(A, 7);
    solver.add(B, 0, 1.0);
    ASSERT_TRUE(solver.solve());
    solver.get(0, X);
  };
  solve();
  const std::size_t before = test::allocation_count();
  solve();
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace counterpoint::sparse_solve_test
