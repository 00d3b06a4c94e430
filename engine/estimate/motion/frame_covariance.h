// Covariances of neighbouring frames of a motion estimate.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/newton/block_cholesky.h"

namespace counterpoint::estimation {

/// Blocks of the inverse of a block-banded matrix of bandwidth 3: covariances of neighbouring
/// frames. All other frames are eliminated, earlier ones in ascending and later ones in descending
/// order; every intermediate matrix is a Schur complement of a positive definite one. (The
/// recursion of Takahashi et al., 1973, needs only one factorization, but its gains grow through
/// stiff contacts until no digit is left.)
class FrameCovariance {
 public:
  /// The band must outlive this.
  explicit FrameCovariance(const optimization::BlockCholesky& band);

  /// The covariance of frames `first` ... `first` + `count` - 1, three or four (count m x count m).
  MatrixX of(int first, int count) const;

 private:
  const optimization::BlockCholesky* band_;
  /// Schur updates (3 m x 3 m) for each frame k: of frames k, k + 1, k + 2 by all frames before k,
  /// and of frames k, k - 1, k - 2 by all frames after k.
  std::vector<MatrixX> before_, behind_;
};

}  // namespace counterpoint::estimation
