// Linear systems whose matrix has the zeros of a tree's inertia.
#pragma once

#include <vector>

#include "counterpoint/model/types.h"

namespace counterpoint {

/// Solves A X = B by elimination from the last unknown to the first: of matrices with the pattern
/// of a tree's M no zero is lost (Featherstone 2008, section 6.5), and zeros cost nothing. Rows are
/// exchanged where a pivot is small against what is below it. Scratch inside, grown only.
class SparseSolver {
 public:
  /// Takes A (n x n) and room for `columns` right-hand sides, zero at first.
  void begin(const Eigen::Ref<const MatrixX>& A, int columns);
  /// Adds `scale` times a matrix (n rows) to the right-hand sides from `column` on; or the
  /// identity.
  void add(const Eigen::Ref<const MatrixX>& B, int column, double scale);
  void add_identity(int column);
  /// False if A is singular.
  bool solve();
  /// The solution's columns from `column` on, as many as `out` has (n rows).
  void get(int column, Eigen::Ref<MatrixX> out) const;

 private:
  int n_ = 0, columns_ = 0, stride_ = 0;
  std::vector<double> rows_;  ///< row by row, A and B side by side
};

}  // namespace counterpoint
