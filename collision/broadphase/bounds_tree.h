// Pairs of overlapping boxes, found with the tree of the Flexible Collision Library (FCL).
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"

namespace counterpoint::collision {

/// FCL's dynamic tree of axis-aligned boxes. The shape of the tree depends on earlier calls, the
/// set of pairs does not. Allocates only when the number of boxes changes.
class BoundsTree {
 public:
  BoundsTree();
  ~BoundsTree();
  BoundsTree(BoundsTree&&) noexcept;
  BoundsTree& operator=(BoundsTree&&) noexcept;

  std::size_t size() const;  ///< number of boxes of the last call
  /// Builds a tree of these boxes if their number differs from the last call.
  void prepare(const std::vector<Bounds>& boxes);
  /// Appends the index pairs (first < second) of boxes that overlap, in any order. Takes at least
  /// two boxes; bounds are finite, or inverted for a box that overlaps nothing.
  void find_pairs(const std::vector<Bounds>& boxes, std::vector<std::pair<int, int>>& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::collision
