#include "counterpoint/contact/linear/dense_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "counterpoint/contact/linear/row_count.h"
#include "counterpoint/contact/linear/vector_lanes.h"

namespace counterpoint::contact {
namespace {

// Columns finished at a time; a multiple of four: rows that a tile takes too many are padding.
constexpr int kColumns = 4;
// Large fronts are taken in parts that stay in the cache: so many columns together, so many
// products at once. No order of summation changes.
constexpr int kPart = 32, kProducts = 64;

// A tile of kLanes times four rows and kCount columns: c -= a b', b' by rows of b; or c = -a b'.
template <int kLanes, int kCount>  // Parameters: matrices and their places
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

// kCount columns of m rows, up to three rows more.
template <int kCount>  // Parameters: matrices and their places
COUNTERPOINT_INTO_EACH void subtract_columns(const double* a, int lda, const double* b, int ldb,
                                             double* c, int ldc, int m, int k, bool fresh) {
  int i = 0;
  for (; m - i > 4; i += 8) subtract_tile<2, kCount>(a + i, lda, b, ldb, c + i, ldc, k, fresh);
  if (i < m) subtract_tile<1, kCount>(a + i, lda, b, ldb, c + i, ldc, k, fresh);
}

// Parameters: matrices and their places.
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

// The lower trapezoid of c -= a b', `columns` of m rows from the diagonal down.
// Parameters: matrices and their places.
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

// column[0..m) += or -= sum over k of a[:, k] * b[k].
template <bool kPlus>
COUNTERPOINT_INTO_EACH void add_columns(double* __restrict column, const double* __restrict a,
                                        int lda, const double* __restrict b, int m, int k) {
  const auto add = [](double& to, double value) __attribute__((always_inline)) {
    to = kPlus ? to + value : to - value;
  };
  int p = 0;
  for (; p + 4 <= k; p += 4) {
    const double b0 = b[p], b1 = b[p + 1], b2 = b[p + 2], b3 = b[p + 3];
    const double* a0 = a + static_cast<std::ptrdiff_t>(p) * lda;
    const double* a1 = a0 + lda;
    const double* a2 = a1 + lda;
    const double* a3 = a2 + lda;
    for (int i = 0; i < m; ++i)
      add(column[i], (a0[i] * b0 + a1[i] * b1) + (a2[i] * b2 + a3[i] * b3));
  }
  for (; p < k; ++p) {
    const double b0 = b[p];
    const double* a0 = a + static_cast<std::ptrdiff_t>(p) * lda;
    for (int i = 0; i < m; ++i) add(column[i], a0[i] * b0);
  }
}

// The dot products of kCount columns with x, four lanes each and what is over.
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

// own[first, first + count) less the products of those columns with x.
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

// As many rows of a block as there are Lanes: block += A' H, A and H of N rows.
template <int N, class Lanes>
COUNTERPOINT_INTO_EACH void add_outer_lanes(const double* a, const double* h, int leading,
                                            int num_columns, double* block, int block_leading) {
  Lanes row[N];
  COUNTERPOINT_UNROLL
  for (int r = 0; r < N; ++r) load(a + r * leading, row[r]);
  for (int j = 0; j < num_columns; ++j, block += block_leading) {
    Lanes sum;
    load(block, sum);
    COUNTERPOINT_UNROLL
    for (int r = 0; r < N; ++r) add_product(row[r], h[r * leading + j], sum);
    store(sum, block);
  }
}

template <int N>
COUNTERPOINT_INTO_EACH void add_outer(const CongruencePlace& place, const double* jacobian,
                                      const double* h, int leading, double* block) {
  const double* a = jacobian + place.row;
  const int n = place.num_rows, columns = place.num_columns, ld = place.leading;
  h += place.column;
  block += place.offset;
  if (n == 6) return add_outer_lanes<N, Six>(a, h, leading, columns, block, ld);
  int i = 0;
  for (; i + 4 <= n; i += 4) add_outer_lanes<N, Four>(a + i, h, leading, columns, block + i, ld);
  if (n - i == 3) return add_outer_lanes<N, Three>(a + i, h, leading, columns, block + i, ld);
  if (n - i == 2) return add_outer_lanes<N, Two>(a + i, h, leading, columns, block + i, ld);
  if (n - i == 1) add_outer_lanes<N, double>(a + i, h, leading, columns, block + i, ld);
}

// out = G J, or G' J.
template <int N, bool kTransposed>
COUNTERPOINT_INTO_EACH void multiply_rows(const double* g, const double* jacobian, int leading,
                                          double* out) {
  for (int k = 0; k < leading; k += 4) {
    Four row[N];
    COUNTERPOINT_UNROLL
    for (int s = 0; s < N; ++s) load(jacobian + s * leading + k, row[s]);
    COUNTERPOINT_UNROLL
    for (int r = 0; r < N; ++r) {
      Four sum = row[0] * (kTransposed ? g[r] : g[r * N]);
      COUNTERPOINT_UNROLL
      for (int s = 1; s < N; ++s) sum += row[s] * (kTransposed ? g[s * N + r] : g[r * N + s]);
      store(sum, out + r * leading + k);
    }
  }
}

template <int N>  // Parameters: matrices and their places
COUNTERPOINT_INTO_EACH void add_congruence_of(int leading, const double* jacobian, const double* g,
                                              std::span<const CongruencePlace> places,
                                              double* scratch, double* lower, double* upper) {
  multiply_rows<N, false>(g, jacobian, leading, scratch);
  for (const CongruencePlace& place : places)
    add_outer<N>(place, jacobian, scratch, leading, lower);
  if (upper == nullptr || places.size() == 1) return;
  double* transposed = scratch + N * leading;
  multiply_rows<N, true>(g, jacobian, leading, transposed);
  for (const CongruencePlace& place : places) {
    if (!place.diagonal) add_outer<N>(place, jacobian, transposed, leading, upper);
  }
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
      double* __restrict column = panel + j * ld;
      for (int p = first; p < j; ++p) {
        const double* __restrict other = panel + p * ld;
        const double factor = other[j];
        for (int i = j; i < rows; ++i) column[i] -= other[i] * factor;
      }
      if (!(column[j] > 0.0)) return false;
      column[j] = std::sqrt(column[j]);
      const double scale = inverse[j] = 1.0 / column[j];
      for (int i = j + 1; i < rows; ++i) column[i] *= scale;
    }
  }
  subtract_lower(panel + cols, panel + cols, shape.leading, rest, shape.leading_rest, shape.below,
                 shape.below, cols, fresh);
  return true;
}

namespace {

// Column j of both factors after what the columns from `first` on have taken from it.
COUNTERPOINT_INTO_EACH bool finish_lu_column(const FrontShape& shape, int first, int j, double* l,  // Parameters: rows
                                             double* u, double* inverse, double* growth) {
  const int rows = shape.cols + shape.below, ld = shape.leading;
  double* __restrict below = l + static_cast<std::ptrdiff_t>(j) * ld;
  double* __restrict right = u + static_cast<std::ptrdiff_t>(j) * ld;
  for (int p = first; p < j; ++p) {
    const double* __restrict lp = l + static_cast<std::ptrdiff_t>(p) * ld;
    const double* __restrict up = u + static_cast<std::ptrdiff_t>(p) * ld;
    const double from_l = up[j], from_u = lp[j];
    for (int i = j; i < rows; ++i) {
      below[i] -= lp[i] * from_l;
      right[i] -= up[i] * from_u;
    }
  }
  if (!(std::abs(below[j]) > 0.0)) return false;
  const double scale = inverse[j] = 1.0 / below[j];
  for (int i = j + 1; i < rows; ++i) {
    below[i] *= scale;
    growth[i] += std::abs(below[i] * right[i]);
  }
  return true;
}

}  // namespace

COUNTERPOINT_WIDE bool factor_front_lu(const FrontShape& shape, double* l, double* u,
                                       double* inverse, double* rest_l, double* rest_u, bool fresh,
                                       double* growth) {
  const int cols = shape.cols, rows = cols + shape.below, leading = shape.leading;
  const std::ptrdiff_t ld = leading;
  std::fill(growth, growth + rows, 0.0);
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
  add_columns<true>(out, panel + cols, ld, own, shape.below, cols);
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

COUNTERPOINT_WIDE void add_congruence(int rows, int leading, const double* jacobian,
                                      const double* g, std::span<const CongruencePlace> places,
                                      double* scratch, double* lower, double* upper) {
  with_rows(
      rows, [&]<int N>(RowCount<N>) __attribute__((always_inline)) {
        add_congruence_of<N>(leading, jacobian, g, places, scratch, lower, upper);
      });
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
  add_columns<true>(out, a, n, x, n, n);
}

}  // namespace counterpoint::contact
