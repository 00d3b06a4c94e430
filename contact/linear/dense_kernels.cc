#include "counterpoint/contact/linear/dense_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "counterpoint/contact/lanes/vector_lanes.h"

namespace counterpoint::contact {
namespace {

// Columns finished at a time. A multiple of four, so the surplus rows of a tile are padding.
constexpr int kColumns = 4;
// Large fronts are processed in parts that stay in the cache: kPart columns together, kProducts
// products at once. The order of summation does not change.
constexpr int kPart = 32, kProducts = 64;

// Updates a tile of kLanes times four rows and kCount columns, c -= a b', where b has a row for
// each column of c; with `fresh` c = -a b'.
template <int kLanes, int kCount>
COUNTERPOINT_INTO_EACH void subtract_tile(const double* a, int lda, const double* b, int ldb,
                                          double* c, int ldc, int k, bool fresh) {
  Four sum[kCount][kLanes];
  for (int j = 0; j < kCount; ++j) {
    for (int v = 0; v < kLanes; ++v) {
      if (fresh) {
        sum[j][v] = Four{};
      } else {
        load(c + static_cast<std::ptrdiff_t>(j) * ldc + 4 * v, sum[j][v]);
      }
    }
  }
  for (int p = 0; p < k; ++p, a += lda, b += ldb) {
    Four column[kLanes];
    for (int v = 0; v < kLanes; ++v) load(a + 4 * v, column[v]);
    for (int j = 0; j < kCount; ++j) {
      for (int v = 0; v < kLanes; ++v) sum[j][v] -= column[v] * b[j];
    }
  }
  for (int j = 0; j < kCount; ++j) {
    for (int v = 0; v < kLanes; ++v)
      store(sum[j][v], c + static_cast<std::ptrdiff_t>(j) * ldc + 4 * v);
  }
}

// Updates kCount columns of m rows, and up to three rows of padding.
template <int kCount>
COUNTERPOINT_INTO_EACH void subtract_columns(const double* a, int lda, const double* b, int ldb,
                                             double* c, int ldc, int m, int k, bool fresh) {
  int i = 0;
  for (; m - i > 4; i += 8) subtract_tile<2, kCount>(a + i, lda, b, ldb, c + i, ldc, k, fresh);
  if (i < m) subtract_tile<1, kCount>(a + i, lda, b, ldb, c + i, ldc, k, fresh);
}

// Calls subtract_columns for `count` columns.
COUNTERPOINT_INTO_EACH void subtract_some(int count, const double* a, int lda, const double* b,
                                          int ldb, double* c, int ldc, int m, int k, bool fresh) {
  switch (count) {
    case 1:
      return subtract_columns<1>(a, lda, b, ldb, c, ldc, m, k, fresh);
    case 2:
      return subtract_columns<2>(a, lda, b, ldb, c, ldc, m, k, fresh);
    case 3:
      return subtract_columns<3>(a, lda, b, ldb, c, ldc, m, k, fresh);
    default:
      return subtract_columns<4>(a, lda, b, ldb, c, ldc, m, k, fresh);
  }
}

// Subtracts from column j the columns p = first ... j - 1, each times other[j, p]; also in the rows
// `first` to j - 1, whose values are unused.
COUNTERPOINT_INTO_EACH void subtract_earlier(const double* columns, const double* other, int ld,
                                             int first, int j, int rows, double* column) {
  if (j == first) return;
  const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(first) * ld;
  subtract_columns<1>(columns + begin + first, ld, other + begin + j, ld, column + first, ld,
                      rows - first, j - first, false);
}

// Updates the lower trapezoid of c -= a b': `columns` columns of m rows from the diagonal down.
COUNTERPOINT_INTO_EACH void subtract_lower(const double* a, const double* b, int ld, double* c,
                                           int ldc, int m, int columns, int k, bool fresh) {
  for (int p = 0; p < k; p += kProducts) {
    const std::ptrdiff_t place = static_cast<std::ptrdiff_t>(p) * ld;
    for (int j = 0; j < columns; j += kColumns) {
      subtract_some(std::min(kColumns, columns - j), a + j + place, ld, b + j + place, ld,
                    c + j + static_cast<std::ptrdiff_t>(j) * ldc, ldc, m - j,
                    std::min(kProducts, k - p), fresh && p == 0);
    }
  }
}

// Adds kCount columns, each times its b, to as many rows of `column` as Lanes holds.
template <int kCount, class Lanes>
COUNTERPOINT_INTO_EACH void add_lanes(double* column, const double* a, int lda, const double* b) {
  Lanes to, part[kCount];
  COUNTERPOINT_UNROLL
  for (int p = 0; p < kCount; ++p) {
    load(a + static_cast<std::ptrdiff_t>(p) * lda, part[p]);
    part[p] *= b[p];
  }
  Lanes sum = part[0];
  if constexpr (kCount == 4) sum = (part[0] + part[1]) + (part[2] + part[3]);
  load(column, to);
  to += sum;
  store(to, column);
}

template <int kCount>
COUNTERPOINT_INTO_EACH void add_columns_of(double* column, const double* a, int lda,
                                           const double* b, int m) {
  int i = 0;
  for (; i + 4 <= m; i += 4) add_lanes<kCount, Four>(column + i, a + i, lda, b);
  if (i + 2 <= m) {
    add_lanes<kCount, Two>(column + i, a + i, lda, b);
    i += 2;
  }
  if (i < m) add_lanes<kCount, double>(column + i, a + i, lda, b);
}

// Computes column[0..m) += sum over k of a[:, k] * b[k].
COUNTERPOINT_INTO_EACH void add_columns(double* column, const double* a, int lda, const double* b,
                                        int m, int k) {
  int p = 0;
  for (; p + 4 <= k; p += 4)
    add_columns_of<4>(column, a + static_cast<std::ptrdiff_t>(p) * lda, lda, b + p, m);
  for (; p < k; ++p)
    add_columns_of<1>(column, a + static_cast<std::ptrdiff_t>(p) * lda, lda, b + p, m);
}

// Computes the dot products of kCount columns with x: four lanes each, then the remaining rows.
template <int kCount>
COUNTERPOINT_INTO_EACH void multiply_columns(const double* a, int lda, const double* x, int m,
                                             double* out) {
  Four sum[kCount] = {};
  double over[kCount] = {};
  int i = 0;
  for (; i + 4 <= m; i += 4) {
    Four xi;
    load(x + i, xi);
    for (int j = 0; j < kCount; ++j) {
      Four ai;
      load(a + static_cast<std::ptrdiff_t>(j) * lda + i, ai);
      sum[j] += ai * xi;
    }
  }
  for (; i < m; ++i) {
    for (int j = 0; j < kCount; ++j) over[j] += a[static_cast<std::ptrdiff_t>(j) * lda + i] * x[i];
  }
  for (int j = 0; j < kCount; ++j)
    out[j] = ((sum[j][0] + sum[j][1]) + (sum[j][2] + sum[j][3])) + over[j];
}

// Subtracts from own[0 ... count) the dot products of `count` columns with x.
COUNTERPOINT_INTO_EACH void subtract_products(const double* a, int lda, const double* x, int m,
                                              int count, double* own) {
  double sum[kColumns];
  if (count == kColumns) {
    multiply_columns<kColumns>(a, lda, x, m, sum);
  } else {
    for (int j = 0; j < count; ++j)
      multiply_columns<1>(a + static_cast<std::ptrdiff_t>(j) * lda, lda, x, m, sum + j);
  }
  for (int j = 0; j < count; ++j) own[j] -= sum[j];
}

}  // namespace

COUNTERPOINT_WIDE bool factor_front_cholesky(const FrontShape& shape, double* panel,
                                             double* inverse, double* rest, bool fresh) {
  const int cols = shape.cols, rows = cols + shape.below;
  const std::ptrdiff_t ld = shape.leading;
  for (int first = 0; first < cols; first += kColumns) {
    const int part = first / kPart * kPart, last = std::min(first + kColumns, cols);
    double* here = panel + first * (ld + 1);
    if (first == part) {
      subtract_lower(panel + first, panel + first, shape.leading, here, shape.leading, rows - first,
                     std::min(kPart, cols - first), first, false);
    }
    const double* before = panel + first + part * ld;
    subtract_some(last - first, before, shape.leading, before, shape.leading, here, shape.leading,
                  rows - first, first - part, false);
    for (int j = first; j < last; ++j) {
      double* const column = panel + j * ld;
      subtract_earlier(panel, panel, shape.leading, first, j, rows, column);
      if (!(column[j] > 0.0)) return false;
      const double diagonal = std::sqrt(column[j]);
      const double scale = inverse[j] = 1.0 / diagonal;
      for (int i = first; i < rows; i += 4) {  // up to three rows more, which are padding
        Four below;
        load(column + i, below);
        store(below * scale, column + i);
      }
      column[j] = diagonal;
    }
  }
  subtract_lower(panel + cols, panel + cols, shape.leading, rest, shape.leading_rest, shape.below,
                 shape.below, cols, fresh);
  return true;
}

namespace {

// Finishes column j of L and U': subtracts the columns `first` to j - 1, divides L by the pivot and
// accumulates the growth. False if the pivot is zero (or NaN).
COUNTERPOINT_INTO_EACH bool finish_lu_column(const FrontShape& shape, int first, int j, double* l,
                                             double* u, double* inverse, double* growth) {
  const int rows = shape.cols + shape.below, ld = shape.leading;
  double* const below = l + static_cast<std::ptrdiff_t>(j) * ld;
  double* const right = u + static_cast<std::ptrdiff_t>(j) * ld;
  subtract_earlier(l, u, ld, first, j, rows, below);
  subtract_earlier(u, l, ld, first, j, rows, right);
  const double pivot = below[j];
  if (!(std::abs(pivot) > 0.0)) return false;
  const double scale = inverse[j] = 1.0 / pivot;
  Four above, after;  // the rows up to the pivot's do not grow
  load(growth + first, above);
  for (int i = first; i < rows; i += 4) {
    Four b, r, g;
    load(below + i, b);
    load(right + i, r);
    load(growth + i, g);
    b *= scale;
    store(b, below + i);
    const Four product = b * r;
    store(g + (product < 0.0 ? -product : product), growth + i);
  }
  below[j] = pivot;
  load(growth + first, after);
  const Four row = {0.0, 1.0, 2.0, 3.0};
  store(row > static_cast<double>(j - first) ? after : above, growth + first);
  return true;
}

}  // namespace

COUNTERPOINT_WIDE bool factor_front_lu(const FrontShape& shape, double* l, double* u,
                                       double* inverse, double* rest_l, double* rest_u, bool fresh,
                                       double* growth) {
  const int cols = shape.cols, rows = cols + shape.below, leading = shape.leading;
  const std::ptrdiff_t ld = leading;
  std::fill(growth, growth + in_fours(rows), 0.0);
  for (int first = 0; first < cols; first += kColumns) {
    const int part = first / kPart * kPart, last = std::min(first + kColumns, cols);
    const int height = rows - first, count = last - first, width = std::min(kPart, cols - first);
    double* l_here = l + first * (ld + 1);
    double* u_here = u + first * (ld + 1);
    if (first == part) {
      subtract_lower(l + first, u + first, leading, l_here, leading, height, width, first, false);
      subtract_lower(u + first, l + first, leading, u_here, leading, height, width, first, false);
    }
    const double* l_before = l + first + part * ld;
    const double* u_before = u + first + part * ld;
    subtract_some(count, l_before, leading, u_before, leading, l_here, leading, height,
                  first - part, false);
    subtract_some(count, u_before, leading, l_before, leading, u_here, leading, height,
                  first - part, false);
    for (int j = first; j < last; ++j) {
      if (!finish_lu_column(shape, first, j, l, u, inverse, growth)) return false;
    }
  }
  const int below = shape.below;
  subtract_lower(l + cols, u + cols, leading, rest_l, shape.leading_rest, below, below, cols,
                 fresh);
  subtract_lower(u + cols, l + cols, leading, rest_u, shape.leading_rest, below, below, cols,
                 fresh);
  return true;
}

COUNTERPOINT_WIDE void solve_front_forward(const FrontShape& shape, const double* panel,
                                           const double* inverse, bool scaled, double* own,
                                           double* out) {
  const int cols = shape.cols, ld = shape.leading;
  for (int j = 0; j < cols; ++j) {
    const double* column = panel + static_cast<std::ptrdiff_t>(j) * ld;
    if (scaled) own[j] *= inverse[j];
    const double value = own[j];
    for (int i = j + 1; i < cols; ++i) own[i] -= column[i] * value;
  }
  std::fill(out, out + shape.below, 0.0);
  add_columns(out, panel + cols, ld, own, shape.below, cols);
}

COUNTERPOINT_WIDE void solve_front_backward(const FrontShape& shape, const double* panel,
                                            const double* inverse, const double* x, double* own) {
  const int cols = shape.cols, ld = shape.leading;
  for (int first = (cols - 1) / kColumns * kColumns; first >= 0; first -= kColumns) {
    const int last = std::min(first + kColumns, cols), count = last - first;
    const double* columns = panel + static_cast<std::ptrdiff_t>(first) * ld;
    subtract_products(columns + cols, ld, x, shape.below, count, own + first);
    subtract_products(columns + last, ld, own + last, cols - last, count, own + first);
    for (int j = last - 1; j >= first; --j) {
      const double* column = panel + static_cast<std::ptrdiff_t>(j) * ld;
      double sum = own[j];
      for (int i = j + 1; i < last; ++i) sum -= column[i] * own[i];
      own[j] = sum * inverse[j];
    }
  }
}

COUNTERPOINT_WIDE bool factor_pivoted(double* a, int n, int* pivot) {
  const std::ptrdiff_t ld = n;
  for (int k = 0; k < n; ++k) {
    double* column = a + k * ld;
    int best = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(column[i]) > std::abs(column[best])) best = i;
    }
    pivot[k] = best;
    if (!(std::abs(column[best]) > 0.0)) return false;
    if (best != k) {
      for (int j = 0; j < n; ++j) std::swap(a[k + j * ld], a[best + j * ld]);
    }
    const double inverse = 1.0 / column[k];
    for (int i = k + 1; i < n; ++i) column[i] *= inverse;
    for (int j = k + 1; j < n; ++j) {
      double* __restrict to = a + j * ld;
      const double factor = to[k];
      for (int i = k + 1; i < n; ++i) to[i] -= column[i] * factor;
    }
  }
  return true;
}

void copy_block(const DenseBlock& from, double* out, int leading) {
  const double* column = from.values;
  for (int j = 0; j < from.cols; ++j, column += from.leading) {
    double* to = out + static_cast<std::ptrdiff_t>(j) * leading;
    int i = 0;
    // Blocks are small: calls of memcpy would take longer.
    for (; i + 2 <= from.rows; i += 2) {
      Two pair;
      load(column + i, pair);
      store(pair, to + i);
    }
    if (i < from.rows) to[i] = column[i];
  }
}

void transpose_diagonal(const double* lower, double* upper, int size, int leading) {
  for (int j = 0; j < size; ++j) {
    for (int i = j + 1; i < size; ++i)
      upper[i + static_cast<std::ptrdiff_t>(j) * leading] =
          lower[j + static_cast<std::ptrdiff_t>(i) * leading];
  }
}

COUNTERPOINT_WIDE void multiply_symmetric(const double* __restrict a, int n,
                                          const double* __restrict x, double* __restrict out) {
  if (n == 6) return multiply_six(a, x, out);  // a free body
  std::fill(out, out + n, 0.0);
  add_columns(out, a, n, x, n, n);
}

}  // namespace counterpoint::contact
