#include "counterpoint/engine/estimate/motion/frame_covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace counterpoint::estimation {
namespace {

constexpr int kWidth = 3;  ///< bandwidth: frames coupled to a frame on either side

/// Eliminates frames one by one from one end. Frame k is block k, or block n - 1 - k if `reversed`.
class Elimination {
 public:
  Elimination(const optimization::BlockCholesky& band, bool reversed)
      : band_(band), m_(band.block_size()), n_(band.num_blocks()), reversed_(reversed) {}

  /// Returns for each frame k the Schur update of frames k, k + 1, k + 2 by frames 0 ... k - 1 (3 m
  /// x 3 m).
  std::vector<MatrixX> run() const {
    std::vector<MatrixX> taken(static_cast<std::size_t>(n_));
    MatrixX now = MatrixX::Zero(kWidth * m_, kWidth * m_);
    MatrixX column((kWidth + 1) * m_, m_);
    for (int k = 0; k < n_; ++k) {
      taken[static_cast<std::size_t>(k)] = now;
      for (int a = 0; a <= kWidth; ++a) {
        auto rows = column.middleRows(a * m_, m_);
        rows = k + a < n_ ? block(k + a, k) : MatrixX::Zero(m_, m_);
        if (a < kWidth) rows += now.block(a * m_, 0, m_, m_);
      }
      const Eigen::LLT<MatrixX> own(regular(column.topRows(m_)));
      auto others = column.bottomRows(kWidth * m_);
      own.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(others);
      MatrixX next = MatrixX::Zero(kWidth * m_, kWidth * m_);
      next.topLeftCorner((kWidth - 1) * m_, (kWidth - 1) * m_) =
          now.bottomRightCorner((kWidth - 1) * m_, (kWidth - 1) * m_);
      next.noalias() -= others * others.transpose();
      now.swap(next);
    }
    return taken;
  }

  /// Symmetrizes A and raises its diagonal slightly against round-off in poorly known coordinates.
  static MatrixX regular(const MatrixX& A) {
    MatrixX out = A.selfadjointView<Eigen::Lower>();
    out.diagonal() *= 1.0 + 1e-13;
    return out;
  }

 private:
  /// Block of frames `a` >= `b`, counted from the chosen end; diagonal blocks are full.
  MatrixX block(int a, int b) const {
    if (a == b) {
      const int i = reversed_ ? n_ - 1 - a : a;
      return band_.block(i, i).selfadjointView<Eigen::Lower>();
    }
    return reversed_ ? MatrixX(band_.block(n_ - 1 - b, n_ - 1 - a).transpose()) : band_.block(a, b);
  }

  const optimization::BlockCholesky& band_;
  int m_, n_;
  bool reversed_;
};

}  // namespace

FrameCovariance::FrameCovariance(const optimization::BlockCholesky& band)
    : band_(&band),
      before_(Elimination(band, false).run()),
      behind_(Elimination(band, true).run()) {}

MatrixX FrameCovariance::of(int first, int count) const {
  const int m = band_->block_size(), n = band_->num_blocks(), last = first + count - 1;
  MatrixX A = MatrixX::Zero(count * m, count * m);
  A.topLeftCorner(kWidth * m, kWidth * m) = before_[static_cast<std::size_t>(first)];
  const MatrixX& back = behind_[static_cast<std::size_t>(n - 1 - last)];
  for (int a = 0; a < count; ++a)
    for (int b = 0; b <= a; ++b) {
      auto block = A.block(a * m, b * m, m, m);
      block += band_->block(first + a, first + b);
      if (count - 1 - b < kWidth)
        block += back.block((count - 1 - a) * m, (count - 1 - b) * m, m, m);
    }
  const MatrixX identity = MatrixX::Identity(count * m, count * m);
  return Eigen::LLT<MatrixX>(Elimination::regular(A)).solve(identity);
}

}  // namespace counterpoint::estimation
