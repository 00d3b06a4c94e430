// Small dense kernels of the factorization, on column-major storage with a leading dimension. They
// never allocate, and their order of summation does not depend on the width of the registers.
#pragma once

#include <cstddef>

namespace counterpoint::contact {

/// Front: a square of `cols` columns to be eliminated, and `below` rows below it, which receive the
/// Schur complement (`rest`). Rows are processed four at a time; the padding after the last row is
/// zero on input and undefined on output.
struct FrontShape {
  int cols, below;
  int leading;  ///< leading dimension of the columns: room for all rows, and for the rows below, in
                ///< whole fours
  int leading_rest;  ///< leading dimension of the Schur complement, in whole fours
};

/// Factors a front by Cholesky. `panel`: columns of the symmetric matrix from the diagonal down,
/// overwritten by those of L. `rest` -= B B' in the lower triangle, where B are the rows of L below
/// the square; with `fresh` rest starts at zero. inverse: 1 / L_jj. False if a pivot is not
/// positive (or NaN).
bool factor_front_cholesky(const FrontShape& shape, double* panel, double* inverse, double* rest,
                           bool fresh);

/// Factors a front by LU without pivoting, A = L U, L with unit diagonal. `l`: columns of A from
/// the diagonal down, overwritten by the pivots and, under the diagonal, by L. `u`: columns of A'
/// under the diagonal, overwritten by those of U'. The Schur complement is updated likewise in two
/// lower triangles. inverse: 1 / U_jj. growth, by rows of the panel in whole fours: sum over its
/// columns of |L_ij U_ji|. False if a pivot is zero (or NaN).
bool factor_front_lu(const FrontShape& shape, double* l, double* u, double* inverse, double* rest_l,
                     double* rest_u, bool fresh, double* growth);

/// Replaces own by inv(L) own, where the front's diagonal block L has ones or, if `scaled`, 1 /
/// inverse on its diagonal; out = B own for the rows B below.
void solve_front_forward(const FrontShape& shape, const double* panel, const double* inverse,
                         bool scaled, double* own, double* out);
/// Replaces own by inv(U) (own - C x): U' and C' are in the panel under the diagonal, x has the
/// values of the rows below.
void solve_front_backward(const FrontShape& shape, const double* panel, const double* inverse,
                          const double* x, double* own);

/// Factors a dense n x n matrix without padding by LU with partial pivoting. pivot[j]: row swapped
/// with row j. False if a pivot is zero (or NaN).
bool factor_pivoted(double* a, int n, int* pivot);

/// Column-major block of a matrix.
struct DenseBlock {
  const double* values;
  int leading, rows, cols;
};
/// Copies the block to `out`, column-major.
void copy_block(const DenseBlock& from, double* out, int leading);
/// Sets upper = lower' under the diagonal of a square block.
void transpose_diagonal(const double* lower, double* upper, int size, int leading);

/// Computes out = A x, A symmetric, n x n without padding.
void multiply_symmetric(const double* a, int n, const double* x, double* out);

}  // namespace counterpoint::contact
