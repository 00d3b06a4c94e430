// Random kinematic trees and their mass matrices, from a seed.
#pragma once

#include <algorithm>
#include <vector>

#include "contact/random_problem.h"

namespace counterpoint::contact::testing {

// Velocities of a kinematic tree, parents first: a base, and limbs attached anywhere.
struct Tree {
  std::vector<int> parent;

  static Tree random(Random& random, int base, int limbs) {
    Tree tree;
    for (int i = 0; i < base; ++i) tree.parent.push_back(i - 1);
    for (int l = 0; l < limbs; ++l) {
      int last = random.integer(std::min(5, base - 1), static_cast<int>(tree.parent.size()) - 1);
      const int length = random.integer(1, 6);
      for (int i = 0; i < length; ++i) {
        tree.parent.push_back(last);
        last = static_cast<int>(tree.parent.size()) - 1;
      }
    }
    return tree;
  }
  bool related(int i, int j) const {
    while (i > j) i = parent[i];
    return i == j;
  }
  // Sum of J'J over the bodies, J nonzero for the velocities between body and root: positive
  // definite.
  MatrixX mass(Random& random) const {
    const int n = static_cast<int>(parent.size());
    MatrixX m = MatrixX::Identity(n, n) * 0.01;
    for (int body = 0; body < n; ++body) {
      MatrixX j = MatrixX::Zero(6, n);
      for (int i = body; i >= 0; i = parent[i])
        for (int r = 0; r < 6; ++r) j(r, i) = random.signed_unit();
      m += j.transpose() * j;
    }
    return 0.5 * (m + m.transpose());
  }
};

}  // namespace counterpoint::contact::testing
