// Factorization A = L L' of a symmetric positive semidefinite matrix, up to its rank.
#pragma once

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Computes L (n x rank) with A = L L' by Cholesky with diagonal pivoting; A (n x n) is assumed to
/// be symmetric. Pivots are compared with their own diagonal entry of A, so light and heavy bodies
/// in one matrix keep their digits: |A - L L'|_ij <= tolerance sqrt(A_ii A_jj), approximately.
/// Returns the rank.
int factor_semidefinite(const MatrixX& A, double tolerance, MatrixX& factor);

}  // namespace counterpoint::contact
