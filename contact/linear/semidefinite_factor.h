// A = L L' of a symmetric positive semidefinite matrix, as far as its rank goes.
#pragma once

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// L (n x rank) with A = L L' by Cholesky with pivoting; symmetric.
/// symmetric A is assumed. Each row is judged by its own diagonal, so that light and heavy bodies
/// in one matrix keep their digits: |A - L L'|_ij <= tolerance sqrt(A_ii A_jj), about. Returns the
/// rank.
int factor_semidefinite(const MatrixX& A, double tolerance, MatrixX& factor);

}  // namespace counterpoint::contact
