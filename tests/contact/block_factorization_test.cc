// The sparse block factorization against Eigen's dense one.
#include "counterpoint/contact/linear/block_factorization.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cstring>
#include <limits>

#include "contact/linear_solution.h"
#include "contact/random_problem.h"

namespace counterpoint::contact::block_factorization_test {
namespace {

using testing::backward_error;
using testing::Random;
using testing::random_vector;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// Pattern and values of a random sparse block matrix.
struct RandomMatrix {
  std::vector<int> sizes, start;
  std::vector<std::pair<int, int>> couples;
  MatrixX matrix;

  RandomMatrix(Random& random, int most_blocks, double skew) {
    const int count = random.integer(1, most_blocks);
    int n = 0;
    for (int b = 0; b < count; ++b) {
      sizes.push_back(random.integer(1, 7));
      start.push_back(n);
      n += sizes.back();
    }
    const int num_couples = random.integer(0, 2 * count);
    for (int k = 0; k < num_couples; ++k) {
      const int i = random.integer(0, count - 1), j = random.integer(0, count - 1);
      if (i != j) couples.emplace_back(i, j);
    }
    // Sums of squares on the coupled blocks make the symmetric part positive definite.
    matrix = MatrixX::Identity(n, n) * 0.1;
    const auto add = [&](int i, int j) {
      MatrixX root(sizes[i] + sizes[j], 4), other(4, 4);
      for (int k = 0; k < root.size(); ++k) root.data()[k] = random.signed_unit();
      for (int k = 0; k < other.size(); ++k) other.data()[k] = random.signed_unit();
      const MatrixX part =
          root * (MatrixX::Identity(4, 4) + skew * (other - other.transpose())) * root.transpose();
      const int a = sizes[i], b = sizes[j];
      matrix.block(start[i], start[i], a, a) += part.topLeftCorner(a, a);
      matrix.block(start[j], start[j], b, b) += part.bottomRightCorner(b, b);
      matrix.block(start[i], start[j], a, b) += part.topRightCorner(a, b);
      matrix.block(start[j], start[i], b, a) += part.bottomLeftCorner(b, a);
    };
    for (const auto& [i, j] : couples) add(i, j);
  }

  void analyze(BlockFactorization& factorization) const {
    factorization.begin_structure(sizes);
    for (const auto& [i, j] : couples) factorization.add_coupling(i, j);
    factorization.end_structure();
  }

  void fill(BlockFactorization& factorization, bool unsymmetric) const {
    factorization.set_zero(unsymmetric);
    const auto put = [&](int i, int j) {
      const auto place = factorization.block(i, j);
      for (int r = 0; r < sizes[i]; ++r) {
        for (int c = 0; c < sizes[j]; ++c) {
          const ptrdiff_t to = r + static_cast<ptrdiff_t>(c) * place.leading;
          factorization.lower(place)[to] = matrix(start[i] + r, start[j] + c);
          if (unsymmetric) factorization.upper(place)[to] = matrix(start[j] + c, start[i] + r);
        }
      }
    };
    for (size_t b = 0; b < sizes.size(); ++b) put(static_cast<int>(b), static_cast<int>(b));
    for (const auto& [i, j] : couples) factorization.is_lower(i, j) ? put(i, j) : put(j, i);
  }
};

// Cholesky, and LU without pivoting for a positive definite symmetric part, are backward stable:
// the error is at most n round-offs times the growth factor.
TEST(BlockFactorization, SolvesRandomSparseMatrices) {
  Random random(71);
  BlockFactorization factorization;
  for (int trial = 0; trial < 600; ++trial) {
    const double skew = trial % 3 == 0 ? 0.0 : random.uniform(0.0, 2.0);
    const RandomMatrix random_matrix(random, trial % 10 == 0 ? 60 : 12, skew);
    const MatrixX& matrix = random_matrix.matrix;
    const int n = static_cast<int>(matrix.rows());
    random_matrix.analyze(factorization);
    const VectorX b = random_vector(random, n);
    for (const bool unsymmetric : {false, true}) {
      if (!unsymmetric && skew > 0.0) continue;
      random_matrix.fill(factorization, unsymmetric);
      ASSERT_TRUE(unsymmetric ? factorization.factor_lu() : factorization.factor_cholesky());
      VectorX x = b;
      factorization.solve(x.data());
      const double growth = unsymmetric ? 1.0 + factorization.growth() : 1.0;
      EXPECT_LT(backward_error(matrix, x, b), n * growth * kEpsilon) << trial << " " << unsymmetric;
      // The growth factor of a positive definite matrix is at most 1, here plus round-off.
      if (unsymmetric && skew == 0.0) {
        EXPECT_LT(factorization.growth(), 1.0 + n * kEpsilon);
      }
    }
  }
}

TEST(BlockFactorization, PivotedFactorsSolveWhateverTheMatrix) {
  Random random(32);
  BlockFactorization factorization;
  for (int trial = 0; trial < 200; ++trial) {
    RandomMatrix random_matrix(random, 3, 0.0);
    MatrixX& matrix = random_matrix.matrix;
    const int n = static_cast<int>(matrix.rows());
    random_matrix.couples.clear();
    for (size_t i = 0; i < random_matrix.sizes.size(); ++i) {
      for (size_t j = 0; j < i; ++j)
        random_matrix.couples.emplace_back(static_cast<int>(i), static_cast<int>(j));
    }
    for (int i = 0; i < n * n; ++i) matrix.data()[i] = random.signed_unit();
    random_matrix.analyze(factorization);
    random_matrix.fill(factorization, true);
    ASSERT_TRUE(factorization.factor_pivoted());
    const VectorX b = random_vector(random, n);
    VectorX x = b;
    factorization.solve(x.data());
    // With partial pivoting the growth factor is at most 2^(n - 1), and small in practice.
    EXPECT_LT(backward_error(matrix, x, b), 10.0 * n * kEpsilon) << trial;
  }
}

TEST(BlockFactorization, PivotsNearZeroShowAsGrowthAndPivotingHelps) {
  BlockFactorization factorization;
  factorization.begin_structure({2});
  factorization.end_structure();
  MatrixX matrix(2, 2);
  matrix << 1e-14, 1.0, 1.0, 1.0;
  const auto fill = [&] {
    factorization.set_zero(true);
    const auto place = factorization.block(0, 0);
    factorization.lower(place)[0] = matrix(0, 0);
    factorization.lower(place)[1] = factorization.upper(place)[1] = 1.0;
    factorization.lower(place)[1 + place.leading] = matrix(1, 1);
  };
  fill();
  ASSERT_TRUE(factorization.factor_lu());
  EXPECT_GT(factorization.growth(), 1e13);
  fill();
  ASSERT_TRUE(factorization.factor_pivoted());
  const VectorX b = VectorX::Constant(2, 1.0);
  VectorX x = b;
  factorization.solve(x.data());
  EXPECT_LT(backward_error(matrix, x, b), 4.0 * kEpsilon);
}

// A new object and objects that have analyzed this or other structures give the same bits.
TEST(BlockFactorization, KeptStructureChangesNoBit) {
  Random random(72);
  BlockFactorization used;
  for (int trial = 0; trial < 50; ++trial) {
    const RandomMatrix first(random, 20, 0.5);
    const VectorX b = random_vector(random, static_cast<int>(first.matrix.rows()));
    BlockFactorization fresh;
    std::vector<VectorX> solutions;
    for (BlockFactorization* factorization : {&used, &used, &fresh}) {
      first.analyze(*factorization);
      first.fill(*factorization, true);
      ASSERT_TRUE(factorization->factor_lu());
      solutions.push_back(b);
      factorization->solve(solutions.back().data());
    }
    for (const VectorX& x : solutions)
      EXPECT_EQ(std::memcmp(x.data(), solutions[0].data(), sizeof(double) * x.size()), 0);
  }
}

// Fill-in on a grid of boxes, as in large piles, against that of a band matrix.
TEST(BlockFactorization, GridsFillInLittle) {
  constexpr int kSide = 30;
  BlockFactorization factorization;
  factorization.begin_structure(std::vector<int>(kSide * kSide, 6));
  for (int i = 0; i < kSide * kSide; ++i) {
    if (i % kSide > 0) factorization.add_coupling(i, i - 1);
    if (i >= kSide) factorization.add_coupling(i, i - kSide);
  }
  factorization.end_structure();
  // Nested dissection is bounded by 31 n log2 n / 4 entries of 36 (George, 1973); the band has 900
  // 31.
  EXPECT_LT(factorization.factor_size(), 36 * 31 * 900 * 0.25 * std::log2(30.0));
  EXPECT_LT(factorization.factor_size(), 0.6 * 36 * 900 * 31);
}

}  // namespace
}  // namespace counterpoint::contact::block_factorization_test
