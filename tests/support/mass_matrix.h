// Mass matrix of a whole model, and configurations to compare it at.
#pragma once

#include <random>

#include "counterpoint/model/model.h"

namespace counterpoint::test {

/// Mass matrix, nv x nv, with one block for each tree.
inline MatrixX mass_matrix(const Model& model, const VectorX& q) {
  MatrixX M = MatrixX::Zero(model.nv(), model.nv());
  for (int t = 0; t < model.num_trees(); ++t) {
    const Tree& tree = model.trees()[t];
    const int n = tree.v_end - tree.v_begin;
    M.block(tree.v_begin, tree.v_begin, n, n) = reference_mass_matrix(model, t, q);
  }
  return M;
}

/// Returns random joint coordinates within 1 rad or 1 m; quaternions have unit length.
inline VectorX random_configuration(const Model& model, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  VectorX q(model.nq());
  for (double& x : q) x = uniform(random);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const int n = joint_nq(body.joint_type);
    if (n >= 4) q.segment<4>(body.q_index + n - 4).normalize();
  }
  return q;
}

}  // namespace counterpoint::test
