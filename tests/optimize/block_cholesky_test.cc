// Block factorization against the dense one.
#include "counterpoint/engine/optimize/block_cholesky.h"

#include <gtest/gtest.h>

namespace counterpoint::optimization {
namespace {

constexpr int kSize = 5;

/// Fills a pattern from J'J of random rows that each see three neighbours, and returns it dense.
MatrixX fill(BlockCholesky& system, bool periodic) {
  const int n = system.num_blocks();
  MatrixX dense = MatrixX::Zero(n * kSize, n * kSize);
  std::srand(1);  // Eigen's Random
  for (int t = periodic ? 0 : 1; t < (periodic ? n : n - 1); ++t) {
    MatrixX J = MatrixX::Zero(4, n * kSize);
    for (int k = -1; k <= 1; ++k)
      J.middleCols((t + k + n) % n * kSize, kSize) = MatrixX::Random(4, kSize);
    dense += J.transpose() * J;
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      const auto block = dense.block(i * kSize, j * kSize, kSize, kSize);
      if (system.in_pattern(i, j)) {
        system.block(i, j) = block;
      } else {
        EXPECT_TRUE(block.isZero(0.0)) << i << ", " << j << " is outside the pattern";
      }
    }
  return dense;
}

void compare(int n, bool periodic) {
  BlockCholesky system(n, kSize, periodic);
  MatrixX dense = fill(system, periodic);
  const MatrixX shift = MatrixX::Ones(kSize, n), b = MatrixX::Random(kSize, n);
  dense.diagonal().array() += 0.5;
  ASSERT_TRUE(system.factor(0.5, shift));
  MatrixX x = b;
  system.solve(x);
  const VectorX expected = dense.llt().solve(Eigen::Map<const VectorX>(b.data(), b.size()));
  // Condition about 100: round-off grows as much.
  EXPECT_LT((Eigen::Map<const VectorX>(x.data(), x.size()) - expected).cwiseAbs().maxCoeff(), 1e-12)
      << n << " blocks";
}

TEST(BlockCholesky, SolvesWhatTheDenseFactorizationDoes) {
  for (const int n : {3, 4, 9, 40}) compare(n, false);
}

TEST(BlockCholesky, SolvesPeriodicSystems) {
  for (const int n : {4, 5, 9, 40}) compare(n, true);
}

TEST(BlockCholesky, SaysWhatIsNotPositiveDefinite) {
  BlockCholesky system(4, kSize, false);
  fill(system, false);
  EXPECT_FALSE(system.factor(-100.0, MatrixX::Ones(kSize, 4)));
}

}  // namespace
}  // namespace counterpoint::optimization
