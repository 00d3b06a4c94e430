#include "counterpoint/engine/derivatives/sparse_solve.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/wide.h"

namespace counterpoint {
namespace {

/// A diagonal entry that is not smaller than this share of its column's largest is the pivot.
constexpr double kPivotShare = 0.1;

COUNTERPOINT_INTO_EACH void subtract(double factor, const double* __restrict from, int begin,
                                     int end, double* __restrict row) {
  for (int c = begin; c < end; ++c) row[c] -= factor * from[c];
}

/// Puts a good pivot of column k among rows 0 ... k into row k. False if there is none.
bool choose_pivot(double* rows, int stride, int k) {
  int best = k;
  for (int i = 0; i < k; ++i)
    if (std::abs(rows[i * stride + k]) > std::abs(rows[best * stride + k])) best = i;
  const double most = std::abs(rows[best * stride + k]);
  if (!(most > 0.0)) return false;
  if (std::abs(rows[k * stride + k]) < kPivotShare * most)
    std::swap_ranges(rows + k * stride, rows + (k + 1) * stride, rows + best * stride);
  return true;
}

COUNTERPOINT_WIDE void eliminate_column(double* rows, int stride, int n, int width, int k) {
  const double* pivot = rows + k * stride;
  const double inverse = 1.0 / pivot[k];
  for (int i = 0; i < k; ++i) {
    double* row = rows + i * stride;
    if (row[k] == 0.0) continue;
    const double factor = row[k] * inverse;
    subtract(factor, pivot, 0, k, row);
    subtract(factor, pivot, n, width, row);
  }
}

COUNTERPOINT_WIDE void substitute(double* rows, int stride, int n, int width) {
  for (int k = 0; k < n; ++k) {
    double* row = rows + k * stride;
    for (int j = 0; j < k; ++j)
      if (row[j] != 0.0) subtract(row[j], rows + j * stride, n, width, row);
    const double inverse = 1.0 / row[k];
    for (int c = n; c < width; ++c) row[c] *= inverse;
  }
}

}  // namespace

void SparseSolver::begin(const Eigen::Ref<const MatrixX>& A, int columns) {
  n_ = static_cast<int>(A.rows());
  columns_ = columns;
  stride_ = n_ + columns;
  rows_.assign(static_cast<size_t>(n_) * static_cast<size_t>(stride_), 0.0);
  for (int j = 0; j < n_; ++j)
    for (int i = 0; i < n_; ++i) rows_[static_cast<size_t>(i * stride_ + j)] = A(i, j);
}

void SparseSolver::add(const Eigen::Ref<const MatrixX>& B, int column, double scale) {
  for (int j = 0; j < B.cols(); ++j)
    for (int i = 0; i < n_; ++i)
      rows_[static_cast<size_t>(i * stride_ + n_ + column + j)] += scale * B(i, j);
}

void SparseSolver::add_identity(int column) {
  for (int i = 0; i < n_; ++i) rows_[static_cast<size_t>(i * stride_ + n_ + column + i)] += 1.0;
}

bool SparseSolver::solve() {
  for (int k = n_ - 1; k >= 0; --k) {
    if (!choose_pivot(rows_.data(), stride_, k)) return false;
    eliminate_column(rows_.data(), stride_, n_, stride_, k);
  }
  substitute(rows_.data(), stride_, n_, stride_);
  return true;
}

void SparseSolver::get(int column, Eigen::Ref<MatrixX> out) const {
  for (int j = 0; j < out.cols(); ++j)
    for (int i = 0; i < n_; ++i)
      out(i, j) = rows_[static_cast<size_t>(i * stride_ + n_ + column + j)];
}

}  // namespace counterpoint
