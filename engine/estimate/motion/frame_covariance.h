// Covariances of neighbouring frames of a motion estimate.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/newton/block_cholesky.h"

namespace counterpoint::estimation {

/// Covariances of the frames of a band of width 3: its inverse at these places. All other frames
/// are eliminated, those before in ascending and those behind in descending order: every matrix on
/// the way is a Schur complement of a positive definite one. (The recursion of Takahashi and
/// others, 1973, needs one factorization, but its gains grow through stiff contacts until no digit
/// is left.)
class FrameCovariance {
 public:
  /// The band must outlive this.
  explicit FrameCovariance(const optimization::BlockCholesky& band);

  /// The covariance of frames `first` ... `first` + `count` - 1, three or four (count m x count m).
  MatrixX of(int first, int count) const;

 private:
  const optimization::BlockCholesky* band_;
  /// For each frame k, what all frames before it take from frames k, k + 1, k + 2, and all frames
  /// behind it from k, k - 1, k - 2 (3 m x 3 m).
  std::vector<MatrixX> before_, behind_;
};

}  // namespace counterpoint::estimation
