// Right-hand sides of linear systems, and the backward error of a solution.
#pragma once

#include "contact/random_problem.h"

namespace counterpoint::contact::testing {

inline VectorX random_vector(Random& random, int n) {
  VectorX x(n);
  for (int i = 0; i < n; ++i) x[i] = random.signed_unit();
  return x;
}

// Backward error of a solution: of the order of the round-off of a matrix product if it is good.
inline double backward_error(const MatrixX& a, const VectorX& x, const VectorX& b) {
  return (a * x - b).norm() / (a.norm() * x.norm() + b.norm());
}

}  // namespace counterpoint::contact::testing
