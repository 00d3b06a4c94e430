#include "counterpoint/contact/linear/semidefinite_factor.h"

#include <cmath>
#include <vector>

namespace counterpoint::contact {

int factor_semidefinite(const MatrixX& A, double tolerance, MatrixX& factor) {
  const int n = static_cast<int>(A.rows());
  factor.setZero(n, n);
  const VectorX original = A.diagonal();
  VectorX diagonal = original;  // diagonal of the Schur complement
  std::vector<bool> done(n, false);
  // Remaining share of a diagonal entry; negative where the row is used or was zero from the start.
  const auto share = [&](int i) {
    return done[i] || !(original[i] > 0.0) ? -1.0 : diagonal[i] / original[i];
  };
  int rank = 0;
  for (; rank < n; ++rank) {
    int pivot = 0;
    for (int i = 1; i < n; ++i) {
      if (share(i) > share(pivot)) pivot = i;
    }
    if (!(share(pivot) > tolerance)) break;
    const double root = std::sqrt(diagonal[pivot]);
    done[pivot] = true;
    VectorX column = A.col(pivot);
    column.noalias() -= factor.leftCols(rank) * factor.row(pivot).head(rank).transpose();
    for (int i = 0; i < n; ++i) {
      if (done[i]) continue;
      const double value = column[i] / root;
      factor(i, rank) = value;
      diagonal[i] -= value * value;
    }
    factor(pivot, rank) = root;
  }
  factor.conservativeResize(n, rank);
  return rank;
}

}  // namespace counterpoint::contact
