// Pairs of boxes that overlap, by the tree of the Flexible Collision Library (FCL).
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"

namespace counterpoint::collision {

/// FCL's dynamic tree of axis-aligned boxes. The shape of the tree depends on the calls before, the
/// set of pairs does not. Allocates when the number of boxes changes, else never.
class BoundsTree {
 public:
  BoundsTree();
  ~BoundsTree();
  BoundsTree(BoundsTree&&) noexcept;
  BoundsTree& operator=(BoundsTree&&) noexcept;

  std::size_t size() const;  ///< number of boxes of the last call
  /// Makes a tree of these boxes if their number is not that of the last call.
  void prepare(const std::vector<Bounds>& boxes);
  /// Appends the index pairs (first < second) of boxes that overlap, in any order. Bounds: finite,
  /// or inverted for a box that meets nothing; two boxes or more.
  void find_pairs(const std::vector<Bounds>& boxes, std::vector<std::pair<int, int>>& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::collision
