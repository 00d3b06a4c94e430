// Islands: sets of velocity blocks connected by constraints, found by union-find.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

class Islands {
 public:
  /// Finds the islands, in the order of their lowest block; blocks and constraints inside are in
  /// increasing order. Blocks without constraints belong to none. If `split` is false, all blocks
  /// form one island.
  void compute(const Problem& problem, bool split);

  int count() const { return static_cast<int>(block_range_.size()) - 1; }
  /// Returns whether the block belongs to an island.
  bool constrained(int block) const { return island_of_[block] >= 0; }
  std::span<const int> blocks(int island) const { return range(blocks_, block_range_, island); }
  std::span<const int> constraints(int island) const {
    return range(constraints_, constraint_range_, island);
  }

 private:
  static std::span<const int> range(const std::vector<int>& items, const std::vector<int>& start,
                                    int island) {
    return {items.data() + start[island], items.data() + start[island + 1]};
  }

  DisjointSets sets_;
  std::vector<int> island_of_;
  std::vector<int> blocks_, block_range_{0}, constraints_, constraint_range_{0};
};

}  // namespace counterpoint::contact
