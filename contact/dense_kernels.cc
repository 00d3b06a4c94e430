#include "counterpoint/contact/dense_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>

#include "counterpoint/contact/row_count.h"
#include "counterpoint/contact/wide.h"

namespace counterpoint::contact {
namespace {

enum class Sign { kPlus, kMinus };

// column[0..m) += or -= sum over k of a[:, k] * b[k]; b has a stride.
template <Sign kSign>
COUNTERPOINT_INTO_EACH void add_columns(double* __restrict column, const double* __restrict a,
                                        int lda, const double* __restrict b, int b_stride, int m,
                                        int k) {
  const auto add = [](double& to, double value) __attribute__((always_inline)) {
    if (kSign == Sign::kPlus) {
      to += value;
    } else {
      to -= value;
    }
  };
  int p = 0;
  for (; p + 4 <= k; p += 4) {
    const double b0 = b[p * b_stride], b1 = b[(p + 1) * b_stride];
    const double b2 = b[(p + 2) * b_stride], b3 = b[(p + 3) * b_stride];
    const double* a0 = a + static_cast<std::ptrdiff_t>(p) * lda;
    const double* a1 = a0 + lda;
    const double* a2 = a1 + lda;
    const double* a3 = a2 + lda;
    for (int i = 0; i < m; ++i)
      add(column[i], (a0[i] * b0 + a1[i] * b1) + (a2[i] * b2 + a3[i] * b3));
  }
  for (; p < k; ++p) {
    const double b0 = b[p * b_stride];
    const double* a0 = a + static_cast<std::ptrdiff_t>(p) * lda;
    for (int i = 0; i < m; ++i) add(column[i], a0[i] * b0);
  }
}

// column[0..rows) after the first `cols` columns of a unit lower triangle, four at a time: each
// finishes four entries, then takes them from all that is below.
COUNTERPOINT_INTO_EACH void eliminate(double* column, const double* l, int ld, int rows, int cols) {
  int k = 0;
  for (; k + 4 <= cols; k += 4) {
    const double* l0 = l + k * ld;
    const double* l1 = l0 + ld;
    const double* l2 = l1 + ld;
    const double c0 = column[k];
    const double c1 = column[k + 1] -= l0[k + 1] * c0;
    const double c2 = column[k + 2] -= l0[k + 2] * c0 + l1[k + 2] * c1;
    column[k + 3] -= (l0[k + 3] * c0 + l1[k + 3] * c1) + l2[k + 3] * c2;
    add_columns<Sign::kMinus>(column + k + 4, l0 + k + 4, ld, column + k, 1, rows - k - 4, 4);
  }
  for (; k < cols; ++k)
    add_columns<Sign::kMinus>(column + k + 1, l + k * ld + k + 1, ld, column + k, 1, rows - k - 1,
                              1);
}

// Four and two doubles at a time.
using Four = double __attribute__((vector_size(32)));
using Two = double __attribute__((vector_size(16)));

// A column of six.
struct Six {
  Four top;
  Two bottom;
};
// By copies: they are at any address.
COUNTERPOINT_INTO_EACH void load(const double* from, Six& to) {
  std::memcpy(&to.top, from, sizeof to.top);
  std::memcpy(&to.bottom, from + 4, sizeof to.bottom);
}
COUNTERPOINT_INTO_EACH void store(const Six& from, double* to) {
  std::memcpy(to, &from.top, sizeof from.top);
  std::memcpy(to + 4, &from.bottom, sizeof from.bottom);
}

// The 6 x 6 x 6 case of free bodies: a stays in registers.
COUNTERPOINT_INTO_EACH void subtract_product_6(const double* a, int lda, const double* b, int ldb,
                                               double* c, int ldc) {
  Six column[6];
  for (int p = 0; p < 6; ++p) load(a + p * lda, column[p]);
  for (int j = 0; j < 6; ++j) {
    Six sum;
    load(c + j * ldc, sum);
    for (int p = 0; p < 6; ++p) {
      const double bp = b[j + p * ldb];
      sum.top -= column[p].top * bp;
      sum.bottom -= column[p].bottom * bp;
    }
    store(sum, c + j * ldc);
  }
}

// Column j of G B.
template <int N>
COUNTERPOINT_INTO_EACH void multiply_column(const double* g, const Columns& b, int j, double* out) {
  for (int r = 0; r < N; ++r) {
    out[r] = 0.0;
    for (int s = 0; s < N; ++s) out[r] += g[r * N + s] * b.values[s * b.leading + j];
  }
}

// A body's six columns, which go to six places in a row.
COUNTERPOINT_INTO_EACH bool is_free_body(const Columns& a) {
  return a.size == 6 && a.places[5] - a.places[0] == 5 && a.places[0] < a.places[1];
}

template <int N>
COUNTERPOINT_INTO_EACH void add_congruence_6(const Columns& a, const Columns& b, const double* g,
                                             double* block, int leading) {
  Six row[N];
  for (int r = 0; r < N; ++r) load(a.values + r * a.leading, row[r]);
  for (int j = 0; j < b.size; ++j) {
    double gb[N];
    multiply_column<N>(g, b, j, gb);
    double* column = block + static_cast<std::ptrdiff_t>(b.places[j]) * leading + a.places[0];
    Six sum;
    load(column, sum);
    for (int r = 0; r < N; ++r) {
      sum.top += row[r].top * gb[r];
      sum.bottom += row[r].bottom * gb[r];
    }
    store(sum, column);
  }
}

template <int N>
COUNTERPOINT_INTO_EACH void add_congruence_of(const Columns& a, const Columns& b, const double* g,
                                              double* block, int leading, bool symmetric) {
  // What is written above the diagonal of a symmetric block does not matter.
  if (is_free_body(a)) return add_congruence_6<N>(a, b, g, block, leading);
  for (int j = 0; j < b.size; ++j) {
    double gb[N];
    multiply_column<N>(g, b, j, gb);
    const int col = b.places[j];
    double* column = block + static_cast<std::ptrdiff_t>(col) * leading;
    const int first = symmetric ? j : 0;
    constexpr int kAtOnce = 16;
    for (int begin = first; begin < a.size; begin += kAtOnce) {
      const int count = std::min(kAtOnce, a.size - begin);
      double sum[kAtOnce];
      for (int i = 0; i < count; ++i) {
        sum[i] = a.values[begin + i] * gb[0];
        for (int r = 1; r < N; ++r) sum[i] += a.values[r * a.leading + begin + i] * gb[r];
      }
      const int* place = a.places + begin;
      for (int i = 0; i < count; ++i) {
        if (symmetric && place[i] < col) {
          block[col + static_cast<std::ptrdiff_t>(place[i]) * leading] += sum[i];
        } else {
          column[place[i]] += sum[i];
        }
      }
    }
  }
}

}  // namespace

COUNTERPOINT_WIDE int factor_panel(double* panel, int rows, int cols, int leading,
                                   double min_pivot) {
  for (int j = 0; j < cols; ++j) {
    double* column = panel + j * leading;
    // Left-looking: all earlier columns at once.
    add_columns<Sign::kMinus>(column + j, panel + j, leading, panel + j, leading, rows - j, j);
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
    add_columns<Sign::kMinus>(right + cols + j * leading, right + cols, leading, below + j, leading,
                              m, j);
  }
  return true;
}

COUNTERPOINT_WIDE void subtract_product(const double* a, int lda, const double* b, int ldb,
                                        double* c, int ldc, int m, int n, int k, bool lower) {
  if (m == 6 && n == 6 && k == 6) return subtract_product_6(a, lda, b, ldb, c, ldc);
  for (int j = 0; j < n; ++j) {
    const int first = lower ? j : 0;
    add_columns<Sign::kMinus>(c + first + j * ldc, a + first, lda, b + j, ldb, m - first, k);
  }
}

COUNTERPOINT_WIDE void add_congruence(int rows, const Columns& a, const Columns& b, const double* g,
                                      double* block, int leading, bool symmetric) {
  with_rows(
      rows, [&]<int N>(RowCount<N>) __attribute__((always_inline)) {
        add_congruence_of<N>(a, b, g, block, leading, symmetric);
      });
}

COUNTERPOINT_WIDE void multiply_symmetric(const double* __restrict a, int n,
                                          const double* __restrict x, double* __restrict out) {
  std::fill(out, out + n, 0.0);
  add_columns<Sign::kPlus>(out, a, n, x, 1, n, n);
}

}  // namespace counterpoint::contact
