// Small dense kernels of the factorization, on column-major storage with a leading dimension. They
// never allocate, and their inner loops run down columns so that compilers vectorize them.
#pragma once

namespace counterpoint::contact {

/// Cholesky of a panel in place: the top `cols` rows hold a symmetric matrix (lower triangle),
/// which becomes L; the `rows` - `cols` rows below become B inv(L)'. Returns the index of the first
/// pivot that is not above `min_pivot`, or -1. A NaN counts as not above.
int factor_panel(double* panel, int rows, int cols, int leading, double min_pivot);

/// LU of a panel in place. The top of `below` holds a square matrix D, its lower rows B; the rows
/// of `right` under the top hold C', C being what stands right of D. With row swaps P (pivot[j]:
/// row swapped with j), P D = L U; B becomes B inv(U), C' becomes (P C)' inv(L)'. False if a pivot
/// is zero or NaN.
bool factor_lu_panel(double* below, double* right, int rows, int cols, int leading, int* pivot);

/// c -= a b', a: m x k, b: n x k, c: m x n. `lower`: only entries on and below c's diagonal matter.
void subtract_product(const double* a, int lda, const double* b, int ldb, double* c, int ldc, int m,
                      int n, int k, bool lower);

/// Columns of a Jacobian of few rows, row by row, and where each goes.
struct Columns {
  const double* values;  ///< row r starts at values + r * leading
  int leading;
  const int* places;
  int size;
};

/// block[place_a i, place_b j] += (A' G B)[i, j]; G: rows x rows, row-major; block: column-major.
/// `symmetric`: a and b are the same, and only entries on and below the block's diagonal matter.
void add_congruence(int rows, const Columns& a, const Columns& b, const double* g, double* block,
                    int leading, bool symmetric);

/// out = A x, A symmetric, n x n without gaps.
void multiply_symmetric(const double* a, int n, const double* x, double* out);

}  // namespace counterpoint::contact
