// Limbs: unbranched runs of velocities of a kinematic tree, found in the zeros of its inertia.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace counterpoint::contact {

/// Velocities are numbered parents first, and M_ij is zero where neither i nor j lies on the
/// other's way to the root. Eliminated from the last to the first, M fills in no more than that
/// (Featherstone, "Efficient factorization of the joint-space inertia matrix for branched kinematic
/// trees", 2005). Limbs are runs of velocities without a branching between them.
class Limbs {
 public:
  /// M: n x n, both triangles. What is no tree costs fill, no more.
  void find(const double* mass, int n);
  /// In increasing order, all of them together n.
  const std::vector<int>& sizes() const { return sizes_; }
  /// Pairs (i, j), i > j, whose block of M is not zero.
  const std::vector<std::pair<int, int>>& couples() const { return couples_; }
  /// The velocity next to each on its way to the root; -1: none.
  const std::vector<int>& parents() const { return parent_; }

 private:
  void find_branchings(int n);
  void find_couples();

  int words_ = 0;
  std::vector<uint64_t> entries_;  ///< by row: where M is not zero left of the diagonal
  std::vector<uint64_t> known_;    ///< entries_ of the call before
  std::vector<uint64_t> filled_;   ///< the same with fill
  std::vector<int> parent_, num_children_, sizes_, start_;
  std::vector<std::pair<int, int>> couples_;
};

}  // namespace counterpoint::contact
