#include "counterpoint/contact/linear/congruence.h"

#include "counterpoint/contact/lanes/vector_lanes.h"
#include "counterpoint/contact/linear/row_count.h"

namespace counterpoint::contact {
namespace {

// Adds A' H to as many rows of a block as Lanes holds; A and H have N rows.
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

// Computes out = G J, or G' J.
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

template <int N>
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

COUNTERPOINT_WIDE void add_congruence(int rows, int leading, const double* jacobian,
                                      const double* g, std::span<const CongruencePlace> places,
                                      double* scratch, double* lower, double* upper) {
  with_rows(
      rows, [&]<int N>(RowCount<N>) __attribute__((always_inline)) {
        add_congruence_of<N>(leading, jacobian, g, places, scratch, lower, upper);
      });
}

}  // namespace counterpoint::contact
