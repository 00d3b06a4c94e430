// Small dense kernels of the factorization, on column-major storage with a leading dimension. They never
// allocate, and their inner loops run down columns so that compilers vectorize them.
#pragma once

namespace counterpoint::contact {

/// Cholesky of a panel in place: the top `cols` rows hold a symmetric matrix (lower triangle), which
/// becomes L; the `rows` - `cols` rows below become B inv(L)'. Returns the index of the first pivot that
/// is not above `min_pivot`, or -1. A NaN counts as not above.
int factor_panel(double* panel, int rows, int cols, int leading, double min_pivot);

/// c -= a b', a: m x k, b: n x k, c: m x n. `lower`: only entries on and below c's diagonal matter.
void subtract_product(const double* a, int lda, const double* b, int ldb, double* c, int ldc, int m,
                      int n, int k, bool lower);

}  // namespace counterpoint::contact
