#include "counterpoint/contact/dense_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "counterpoint/contact/wide.h"

namespace counterpoint::contact {
namespace {

// What the kernels below share becomes part of each of their two versions.
#define COUNTERPOINT_INTO_EACH __attribute__((always_inline)) inline

// column[0..m) -= sum over k of a[:, k] * b[k]; b has a stride.
COUNTERPOINT_INTO_EACH void subtract_columns(double* __restrict column, const double* __restrict a,
                                             int lda, const double* __restrict b, int b_stride,
                                             int m, int k) {
  int p = 0;
  for (; p + 4 <= k; p += 4) {
    const double b0 = b[p * b_stride], b1 = b[(p + 1) * b_stride];
    const double b2 = b[(p + 2) * b_stride], b3 = b[(p + 3) * b_stride];
    const double* a0 = a + p * lda;
    const double* a1 = a0 + lda;
    const double* a2 = a1 + lda;
    const double* a3 = a2 + lda;
    for (int i = 0; i < m; ++i) column[i] -= (a0[i] * b0 + a1[i] * b1) + (a2[i] * b2 + a3[i] * b3);
  }
  for (; p < k; ++p) {
    const double b0 = b[p * b_stride];
    const double* a0 = a + p * lda;
    for (int i = 0; i < m; ++i) column[i] -= a0[i] * b0;
  }
}

// column[0..rows) after the first `cols` columns of a unit lower triangle, four at a time: each
// finishes four entries, then takes them from all that is below.
COUNTERPOINT_INTO_EACH void eliminate(double* __restrict column, const double* __restrict l, int ld,
                                      int rows, int cols) {
  int k = 0;
  for (; k + 4 <= cols; k += 4) {
    const double* l0 = l + k * ld;
    const double* l1 = l0 + ld;
    const double* l2 = l1 + ld;
    const double* l3 = l2 + ld;
    const double c0 = column[k];
    const double c1 = column[k + 1] -= l0[k + 1] * c0;
    const double c2 = column[k + 2] -= l0[k + 2] * c0 + l1[k + 2] * c1;
    const double c3 = column[k + 3] -= (l0[k + 3] * c0 + l1[k + 3] * c1) + l2[k + 3] * c2;
    for (int i = k + 4; i < rows; ++i)
      column[i] -= (l0[i] * c0 + l1[i] * c1) + (l2[i] * c2 + l3[i] * c3);
  }
  for (; k < cols; ++k) {
    const double* l0 = l + k * ld;
    const double c0 = column[k];
    for (int i = k + 1; i < rows; ++i) column[i] -= l0[i] * c0;
  }
}

// The 6 x 6 x 6 case of free bodies, with bounds the compiler can unroll.
COUNTERPOINT_INTO_EACH void subtract_product_6(const double* __restrict a, int lda,
                                               const double* __restrict b, int ldb,
                                               double* __restrict c, int ldc) {
  for (int j = 0; j < 6; ++j) {
    double sum[6] = {0, 0, 0, 0, 0, 0};
    for (int p = 0; p < 6; ++p) {
      const double bp = b[j + p * ldb];
      for (int i = 0; i < 6; ++i) sum[i] += a[i + p * lda] * bp;
    }
    for (int i = 0; i < 6; ++i) c[i + j * ldc] -= sum[i];
  }
}

}  // namespace

COUNTERPOINT_WIDE int factor_panel(double* panel, int rows, int cols, int leading,
                                   double min_pivot) {
  for (int j = 0; j < cols; ++j) {
    double* column = panel + j * leading;
    // Left-looking: all earlier columns at once.
    subtract_columns(column + j, panel + j, leading, panel + j, leading, rows - j, j);
    const double pivot = column[j];
    if (!(pivot > min_pivot)) return j;
    const double root = std::sqrt(pivot);
    column[j] = root;
    const double inverse = 1.0 / root;
    for (int i = j + 1; i < rows; ++i) column[i] *= inverse;
  }
  return -1;
}

COUNTERPOINT_WIDE bool factor_lu_panel(double* below, double* right, int rows, int cols,
                                       int leading, int* pivot) {
  for (int j = 0; j < cols; ++j) {
    double* column = below + j * leading;
    // Earlier swaps, then earlier columns.
    for (int k = 0; k < j; ++k) std::swap(column[k], column[pivot[k]]);
    eliminate(column, below, leading, rows, j);
    int best = j;
    for (int i = j + 1; i < cols; ++i) {
      if (std::abs(column[i]) > std::abs(column[best])) best = i;
    }
    pivot[j] = best;
    if (best != j) {
      for (int k = 0; k <= j; ++k) std::swap(below[j + k * leading], below[best + k * leading]);
    }
    const double value = column[j];
    if (!(std::abs(value) > 0.0)) return false;
    const double inverse = 1.0 / value;
    for (int i = j + 1; i < rows; ++i) column[i] *= inverse;
  }
  // Rows of C' are as long as D: its columns follow the swaps.
  const int m = rows - cols;
  for (int j = 0; j < cols; ++j) {
    if (pivot[j] == j) continue;
    double* a = right + cols + j * leading;
    double* b = right + cols + pivot[j] * leading;
    for (int i = 0; i < m; ++i) std::swap(a[i], b[i]);
  }
  for (int j = 1; j < cols; ++j) {
    subtract_columns(right + cols + j * leading, right + cols, leading, below + j, leading, m, j);
  }
  return true;
}

COUNTERPOINT_WIDE void subtract_product(const double* a, int lda, const double* b, int ldb,
                                        double* c, int ldc, int m, int n, int k, bool lower) {
  if (m == 6 && n == 6 && k == 6) return subtract_product_6(a, lda, b, ldb, c, ldc);
  for (int j = 0; j < n; ++j) {
    const int first = lower ? j : 0;
    subtract_columns(c + first + j * ldc, a + first, lda, b + j, ldb, m - first, k);
  }
}

COUNTERPOINT_WIDE void multiply_symmetric(const double* __restrict a, int n,
                                          const double* __restrict x, double* __restrict out) {
  std::fill(out, out + n, 0.0);
  int j = 0;
  for (; j + 4 <= n; j += 4) {
    const double* a0 = a + static_cast<std::ptrdiff_t>(j) * n;
    const double* a1 = a0 + n;
    const double* a2 = a1 + n;
    const double* a3 = a2 + n;
    const double x0 = x[j], x1 = x[j + 1], x2 = x[j + 2], x3 = x[j + 3];
    for (int i = 0; i < n; ++i) out[i] += (a0[i] * x0 + a1[i] * x1) + (a2[i] * x2 + a3[i] * x3);
  }
  for (; j < n; ++j) {
    const double* a0 = a + static_cast<std::ptrdiff_t>(j) * n;
    for (int i = 0; i < n; ++i) out[i] += a0[i] * x[j];
  }
}

}  // namespace counterpoint::contact
