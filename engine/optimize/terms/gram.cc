#include "counterpoint/engine/optimize/terms/gram.h"

#include <algorithm>

#include "counterpoint/contact/lanes/wide.h"

namespace counterpoint::optimization {
namespace {

/// Rows that are multiplied at once.
constexpr Eigen::Index kRows = 4;

/// Adds a'a of kRows rows of n entries to the lower triangle of out, whose columns lie `stride`
/// apart.
COUNTERPOINT_WIDE void add_products(const double* a, Eigen::Index n, double* out,
                                    Eigen::Index stride) {
  const double *a0 = a, *a1 = a + n, *a2 = a + 2 * n, *a3 = a + 3 * n;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double b0 = a0[j], b1 = a1[j], b2 = a2[j], b3 = a3[j];
    double* __restrict column = out + j * stride;
    for (Eigen::Index i = j; i < n; ++i)
      column[i] += (a0[i] * b0 + a1[i] * b1) + (a2[i] * b2 + a3[i] * b3);
  }
}

}  // namespace

void GramSum::find_patterns(const Eigen::Ref<const MatrixX>& J) {
  words_ = (J.cols() + 63) / 64;
  patterns_.assign(static_cast<std::size_t>(words_ * J.rows()), 0);
  for (Eigen::Index j = 0; j < J.cols(); ++j)
    for (Eigen::Index i = 0; i < J.rows(); ++i)
      patterns_[static_cast<std::size_t>(i * words_ + j / 64)] |=
          static_cast<std::uint64_t>(J(i, j) != 0.0) << (j % 64);
}

bool GramSum::same_pattern(Eigen::Index i, Eigen::Index j) const {
  const auto pattern = patterns_.begin();
  return std::equal(pattern + i * words_, pattern + (i + 1) * words_, pattern + j * words_);
}

void GramSum::add(const Eigen::Ref<const MatrixX>& J, MatrixX& gram) {
  find_patterns(J);
  for (Eigen::Index first = 0, end = 0; first < J.rows(); first = end) {
    while (end < J.rows() && same_pattern(first, end)) ++end;
    columns_.clear();
    for (Eigen::Index j = 0; j < J.cols(); ++j)
      if (J(first, j) != 0.0) columns_.push_back(static_cast<int>(j));
    if (!columns_.empty()) add_rows(J.middleRows(first, end - first), gram);
  }
}

/// Adds rows that are zero outside columns_.
void GramSum::add_rows(const Eigen::Ref<const MatrixX>& J, MatrixX& gram) {
  const auto n = static_cast<Eigen::Index>(columns_.size());
  const Eigen::Index rows = (J.rows() + kRows - 1) / kRows * kRows;
  packed_.assign(static_cast<std::size_t>(rows * n), 0.0);
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index i = 0; i < J.rows(); ++i)
      packed_[static_cast<std::size_t>(i * n + k)] = J(i, columns_[static_cast<std::size_t>(k)]);
  const bool all = n == gram.rows();
  if (!all) product_.assign(static_cast<std::size_t>(n * n), 0.0);
  double* out = all ? gram.data() : product_.data();
  for (Eigen::Index i = 0; i < rows; i += kRows) add_products(packed_.data() + i * n, n, out, n);
  if (all) return;
  for (Eigen::Index j = 0; j < n; ++j) {
    auto column = gram.col(columns_[static_cast<std::size_t>(j)]);
    for (Eigen::Index i = j; i < n; ++i)
      column[columns_[static_cast<std::size_t>(i)]] +=
          product_[static_cast<std::size_t>(j * n + i)];
  }
}

}  // namespace counterpoint::optimization
