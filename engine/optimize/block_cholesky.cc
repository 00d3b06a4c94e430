#include "counterpoint/engine/optimize/block_cholesky.h"

#include <algorithm>

namespace counterpoint::optimization {

BlockCholesky::BlockCholesky(int num_blocks, int block_size, bool bordered)
    : block_size_(block_size) {
  for (int i = 0; i < num_blocks; ++i) {
    first_.push_back(bordered && i >= num_blocks - 2 ? 0 : std::max(0, i - 2));
    rows_.emplace_back(size(i - first_.back() + 1), MatrixX::Zero(block_size, block_size));
  }
  factor_ = rows_;
}

void BlockCholesky::set_zero() {
  for (auto& row : rows_)
    for (MatrixX& block : row) block.setZero();
}

bool BlockCholesky::factor(double scale, const MatrixX& shift) {
  for (int i = 0; i < num_blocks(); ++i) {
    const int first = first_[size(i)];
    std::vector<MatrixX>& row = factor_[size(i)];
    for (int j = first; j <= i; ++j) {
      MatrixX& L = row[size(j - first)];
      L = block(i, j);
      if (j == i) L.diagonal() += scale * shift.col(i);
      const int from = std::max(first, first_[size(j)]);
      for (int k = from; k < j; ++k) {
        const MatrixX& a = row[size(k - first)];
        if (j == i) {
          L.selfadjointView<Eigen::Lower>().rankUpdate(a, -1.0);
        } else {
          L.noalias() -= a * factor_[size(j)][size(k - first_[size(j)])].transpose();
        }
      }
      if (j == i) {
        Eigen::LLT<Eigen::Ref<MatrixX>, Eigen::Lower> llt(L);
        if (llt.info() != Eigen::Success) return false;
      } else {
        const MatrixX& pivot = factor_[size(j)].back();
        pivot.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(L);
      }
    }
  }
  return true;
}

void BlockCholesky::solve(MatrixX& x) const {
  for (int i = 0; i < num_blocks(); ++i) {
    const int first = first_[size(i)];
    for (int k = first; k < i; ++k)
      x.col(i).noalias() -= factor_[size(i)][size(k - first)] * x.col(k);
    factor_[size(i)].back().triangularView<Eigen::Lower>().solveInPlace(x.col(i));
  }
  for (int i = num_blocks() - 1; i >= 0; --i) {
    const int first = first_[size(i)];
    factor_[size(i)].back().triangularView<Eigen::Lower>().transpose().solveInPlace(x.col(i));
    for (int k = first; k < i; ++k)
      x.col(k).noalias() -= factor_[size(i)][size(k - first)].transpose() * x.col(i);
  }
}

}  // namespace counterpoint::optimization
