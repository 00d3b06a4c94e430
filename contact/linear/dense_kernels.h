// Small dense kernels of the factorization, on column-major storage with a leading dimension. They
// never allocate; what they sum they sum in one order, whatever the width of the registers.
#pragma once

#include <cstddef>

namespace counterpoint::contact {

/// A front: columns to be eliminated, as many rows square, and rows below that get what comes of
/// it. Rows are taken four at a time. What stands in the columns after the last row is zero in what
/// is factored and of no matter in the result.
struct FrontShape {
  int cols, below;
  int leading;  ///< of the columns: room for the rows of the square and below, and for rows below
                ///< in whole fours
  int leading_rest;  ///< of the square of the rows below, for whole fours
};

/// Cholesky of a front. `panel`: columns of the symmetric matrix from the diagonal down become
/// those of L; `rest` -= B B' for the rows B below, lower triangle; with `fresh` rest starts at
/// zero. inverse: 1 / L_jj. False if a pivot is not positive (or not a number).
bool factor_front_cholesky(const FrontShape& shape, double* panel, double* inverse, double* rest,
                           bool fresh);

/// LU of a front without pivoting, A = L U, L of unit diagonal. `l`: columns of A from the diagonal
/// down become those of L under the diagonal, which holds the pivots; `u`: the columns of A' under
/// the diagonal become those of U'. The rest likewise, in two lower triangles. inverse: 1 / U_jj.
/// growth, by rows of the panel in whole fours: sum over its columns of |L_ij U_ji|. False if a
/// pivot is zero (or not a number).
bool factor_front_lu(const FrontShape& shape, double* l, double* u, double* inverse, double* rest_l,
                     double* rest_u, bool fresh,
                     double* growth);  // Parameters: matrices and their places

/// own -> inv(L) own, where the front's diagonal block L has ones or, `scaled`, 1 / inverse on its
/// diagonal; out = B own for the rows below.
void solve_front_forward(const FrontShape& shape, const double* panel, const double* inverse,
                         bool scaled, double* own, double* out);
/// own -> inv(U) (own - C x), with U' and C' in the panel under the diagonal and x by rows below.
void solve_front_backward(const FrontShape& shape, const double* panel, const double* inverse,
                          const double* x, double* own);

/// LU of a square matrix with partial pivoting, n x n without gaps. pivot[j]: row swapped with j.
/// False if a pivot is zero (or not a number).
bool factor_pivoted(double* a, int n, int* pivot);

/// A block of numbers, column-major.
struct DenseBlock {
  const double* values;
  int leading, rows, cols;
};
/// Copies the block.
void copy_block(const DenseBlock& from, double* out, int leading);
/// upper = lower' under the diagonal of a square.
void transpose_diagonal(const double* lower, double* upper, int size, int leading);

/// out = A x, A symmetric, n x n without gaps.
void multiply_symmetric(const double* a, int n, const double* x, double* out);

}  // namespace counterpoint::contact
