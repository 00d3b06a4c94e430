// Cholesky factorization of matrices in square blocks, of which each row knows those beside it: the
// normal equations of a motion, whose instants see three frames.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "counterpoint/model/types.h"

namespace counterpoint::optimization {

/// A symmetric matrix of n x n blocks, each m x m: block (i, j) may differ from zero where
/// |i - j| <= 2, and, if it is bordered, in the last two rows and columns (a periodic motion). Its
/// factorization takes O(n m^3) either way.
class BlockCholesky {
 public:
  BlockCholesky(int num_blocks, int block_size, bool bordered);

  /// The lower triangle: j <= i, in the pattern; m x m.
  MatrixX& block(int i, int j) { return rows_[size(i)][size(j - first_[size(i)])]; }
  const MatrixX& block(int i, int j) const { return rows_[size(i)][size(j - first_[size(i)])]; }
  bool in_pattern(int i, int j) const { return j <= i && j >= first_[size(i)]; }
  int num_blocks() const { return static_cast<int>(rows_.size()); }
  void set_zero();

  /// Factors this + scale diag(shift); shift: m x n. False if that is not positive definite.
  bool factor(double scale, const MatrixX& shift);
  /// x (m x n, a column a block) of A x = b, in place. Needs factor().
  void solve(MatrixX& x) const;

 private:
  static std::size_t size(int i) { return static_cast<std::size_t>(i); }

  int block_size_;
  std::vector<int> first_;  ///< by row, the first block in the pattern
  std::vector<std::vector<MatrixX>> rows_, factor_;
  MatrixX transposed_;
};

}  // namespace counterpoint::optimization
