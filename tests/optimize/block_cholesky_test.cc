// Block Cholesky factorization against the dense one.
#include "counterpoint/engine/optimize/newton/block_cholesky.h"

#include <gtest/gtest.h>

namespace counterpoint::optimization::block_cholesky_test {
namespace {

constexpr int kSize = 5;

/// Fills a pattern with J'J of random rows that each involve `width` + 1 neighbouring blocks;
/// returns it dense.
MatrixX fill(BlockCholesky& system, bool periodic) {
  const int n = system.num_blocks(), last = system.width() - 1;
  MatrixX dense = MatrixX::Zero(n * kSize, n * kSize);
  std::srand(1);  // seeds Eigen's Random
  for (int t = periodic ? 0 : 1; t < (periodic ? n : n - last); ++t) {
    MatrixX J = MatrixX::Zero(4, n * kSize);
    for (int k = -1; k <= last; ++k)
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

void compare(int n, bool periodic, int width = 2) {
  contact::ThreadPool one(1), two(2);
  BlockCholesky system(n, kSize, periodic, width);
  MatrixX dense = fill(system, periodic);
  const MatrixX shift = MatrixX::Ones(kSize, n), b = MatrixX::Random(kSize, n);
  dense.diagonal().array() += 0.5;
  ASSERT_TRUE(system.factor(0.5, shift, one));
  MatrixX x = b, same = b;
  system.solve(x, one);
  const VectorX expected = dense.llt().solve(Eigen::Map<const VectorX>(b.data(), b.size()));
  // The condition number is about 100 and amplifies round-off by as much.
  EXPECT_LT((Eigen::Map<const VectorX>(x.data(), x.size()) - expected).cwiseAbs().maxCoeff(), 1e-12)
      << n << " blocks";
  ASSERT_TRUE(system.factor(0.5, shift, two));
  system.solve(same, two);
  EXPECT_EQ(same, x) << "not the same bits with two threads";
}

TEST(BlockCholesky, SolvesWhatTheDenseFactorizationDoes) {
  for (const int n : {1, 2, 3, 4, 5, 9, 40}) compare(n, false);
}

TEST(BlockCholesky, SolvesPeriodicSystems) {
  for (const int n : {4, 5, 6, 7, 9, 40}) compare(n, true);
}

TEST(BlockCholesky, SolvesWiderBands) {
  for (const int width : {1, 3, 4}) {
    for (const int n : {1, 3, 5, 8, 9, 40}) compare(n, false, width);
    for (const int n : {8, 9, 10, 13, 40}) compare(n, true, width);
  }
}

TEST(BlockCholesky, SaysWhatIsNotPositiveDefinite) {
  for (const int n : {4, 9}) {  // found in the chains, or in the root alone
    contact::ThreadPool pool(2);
    BlockCholesky system(n, kSize, false);
    fill(system, false);
    EXPECT_FALSE(system.factor(-100.0, MatrixX::Ones(kSize, n), pool));
  }
}

}  // namespace
}  // namespace counterpoint::optimization::block_cholesky_test
