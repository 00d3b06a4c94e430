// Products of sparse rows with themselves.
#include "counterpoint/engine/optimize/terms/gram.h"

#include <gtest/gtest.h>

#include <random>

namespace counterpoint::optimization::gram_test {
namespace {

/// Rows of which each is zero outside its pattern, one of three, or everywhere.
MatrixX sparse_rows(int rows, int columns, std::mt19937& generator) {
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  std::uniform_int_distribution<int> pattern(0, 3);
  MatrixX out = MatrixX::Zero(rows, columns);
  for (int i = 0; i < rows; ++i) {
    const int kind = pattern(generator);
    for (int j = 0; j < columns; ++j)
      if (kind == 0 || (kind < 3 && j % 3 == kind)) out(i, j) = entry(generator);
  }
  return out;
}

// The lower triangle grows by J'J, the upper one stays. Sums of up to 11 products of numbers below
// 1 differ by their order, by less than 11 times 2.2e-16.
TEST(Gram, IsTheProductOfTheRowsWithThemselves) {
  constexpr double kTolerance = 11 * 11 * 2.3e-16;
  std::mt19937 generator(3);
  GramSum sum;
  for (const int rows : {1, 3, 4, 11}) {
    for (const int columns : {1, 5, 63, 64, 81, 130}) {
      const MatrixX J = sparse_rows(rows, columns, generator);
      const MatrixX before = MatrixX::Random(columns, columns);
      MatrixX gram = before;
      sum.add(J, gram);
      const MatrixX change = gram - before, product = J.transpose() * J;
      for (int j = 0; j < columns; ++j) {
        for (int i = 0; i < j; ++i) ASSERT_EQ(gram(i, j), before(i, j));
        for (int i = j; i < columns; ++i) ASSERT_NEAR(change(i, j), product(i, j), kTolerance);
      }
    }
  }
}

}  // namespace
}  // namespace counterpoint::optimization::gram_test
