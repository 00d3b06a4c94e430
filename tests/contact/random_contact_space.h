// Random contact problems without bodies: A, c and laws, from a seed.
#pragma once

#include <cmath>
#include <vector>

#include "contact/random_problem.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::testing {

/// Returns A = root root' of random rank (half of them rank-deficient), with rows scaled as for
/// masses between 1 and mass_ratio. `scale` receives the inverse mass of each group of rows.
inline MatrixX random_matrix(Random& random, const std::vector<int>& rows, double mass_ratio,
                             std::vector<double>& scale) {
  int n = 0;
  for (const int r : rows) n += r;
  MatrixX root(n, random.coin() ? n : random.integer(1, n));
  for (int i = 0; i < root.size(); ++i) root.data()[i] = random.signed_unit();
  scale.clear();
  int row = 0;
  for (const int r : rows) {
    const double factor = random.log_uniform(1.0 / std::sqrt(mass_ratio), 1.0);
    root.middleRows(row, r) *= factor;
    scale.push_back(factor * factor);
    row += r;
  }
  return root * root.transpose();
}

inline ContactSpaceProblem random_contact_space(Random& random, double mass_ratio,
                                                double max_friction) {
  const int n = random.integer(1, 6);
  ContactSpaceProblem problem;
  std::vector<double> scale;
  problem.A = random_matrix(random, std::vector<int>(n, 3), mass_ratio, scale);
  problem.c.resize(3 * n);
  for (int i = 0; i < 3 * n; ++i) problem.c[i] = random.signed_unit() * std::sqrt(scale[i / 3]);
  for (int i = 0; i < n; ++i) {
    problem.mu.push_back(random.integer(0, 9) == 0 ? 0.0 : random.uniform(0.0, max_friction));
  }
  return problem;
}

}  // namespace counterpoint::contact::testing
