// Limbs: unbranched runs of velocities of a kinematic tree, found from the zeros of its mass
// matrix.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace counterpoint::contact {

/// Velocities are numbered parents first, and M_ij is zero unless i or j lies on the other's path
/// to the root. Elimination from the last to the first creates no further fill (Featherstone,
/// "Efficient factorization of the joint-space inertia matrix for branched kinematic trees", 2005).
/// Limbs are runs of velocities without a branching between them.
class Limbs {
 public:
  /// Finds the limbs of M, n x n, both triangles. A matrix that is not of a tree only causes fill.
  void find(const double* mass, int n);
  /// Sizes of the limbs, in increasing order of their velocities; their sum is n.
  const std::vector<int>& sizes() const { return sizes_; }
  /// Pairs of limbs (i, j), i > j, whose block of M is not zero.
  const std::vector<std::pair<int, int>>& couples() const { return couples_; }
  /// Parent of each velocity: the next one on its path to the root; -1 if none.
  const std::vector<int>& parents() const { return parent_; }

 private:
  void find_branchings(int n);
  void find_couples();

  int words_ = 0;
  std::vector<uint64_t> entries_;  ///< for each row: where M is not zero left of the diagonal
  std::vector<uint64_t> known_;    ///< entries_ of the last call
  std::vector<uint64_t> filled_;   ///< entries_ with fill
  std::vector<int> parent_, num_children_, sizes_, start_;
  std::vector<std::pair<int, int>> couples_;
};

}  // namespace counterpoint::contact
