#include "counterpoint/contact/linear/semidefinite_factor.h"

#include <gtest/gtest.h>

#include "contact/random_contact_space.h"
#include "contact/trials.h"

namespace counterpoint::contact::semidefinite_factor_test {
namespace {

using testing::for_trials;
using testing::Random;
using testing::random_matrix;

TEST(SemidefiniteFactor, KeepsTheDigitsOfLightRowsAmongHeavyOnes) {
  for_trials(1, 1000, [](Random& random, int) {
    constexpr double kTolerance = 1e-14;
    std::vector<double> scale;
    const std::vector<int> rows(random.integer(1, 6), 3);
    const MatrixX a = random_matrix(random, rows, 1e12, scale);
    MatrixX factor;
    const int rank = factor_semidefinite(a, kTolerance, factor);
    EXPECT_EQ(factor.rows(), a.rows());
    EXPECT_EQ(factor.cols(), rank);
    const VectorX own = a.diagonal().cwiseSqrt().cwiseInverse();
    const MatrixX error = own.asDiagonal() * (a - factor * factor.transpose()) * own.asDiagonal();
    // The neglected remainder is semidefinite with a diagonal below the tolerance; sums of up to 18
    // terms add round-off.
    EXPECT_LE(error.cwiseAbs().maxCoeff(), 2.0 * kTolerance);
  });
}

TEST(SemidefiniteFactor, FindsTheRank) {
  for_trials(2, 300, [](Random& random, int) {
    const int n = random.integer(1, 18), rank = random.integer(1, n);
    MatrixX root(n, rank);
    for (int i = 0; i < root.size(); ++i) root.data()[i] = random.signed_unit();
    MatrixX factor;
    // The tolerance is far above the round-off of root root' and far below the pivots of most
    // random matrices.
    EXPECT_LE(factor_semidefinite(root * root.transpose(), 1e-12, factor), rank);
    EXPECT_EQ(factor_semidefinite(root * root.transpose(), 1e-12, factor),
              static_cast<int>(factor.cols()));
  });
  MatrixX factor;
  EXPECT_EQ(factor_semidefinite(MatrixX::Zero(3, 3), 1e-14, factor), 0);
  EXPECT_EQ(factor_semidefinite(MatrixX::Identity(3, 3), 1e-14, factor), 3);
  EXPECT_EQ(factor_semidefinite(MatrixX::Ones(3, 3), 1e-14, factor), 1);
  EXPECT_EQ(factor_semidefinite(MatrixX(), 1e-14, factor), 0);
}

}  // namespace
}  // namespace counterpoint::contact::semidefinite_factor_test
