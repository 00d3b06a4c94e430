// Broad phase: pairs of overlapping axis-aligned boxes.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {

class BoundsGrid;
class BoundsTree;

/// An axis-aligned box in W [m].
struct Bounds {
  Vector3 low, high;
};

/// Returns whether two boxes overlap or touch.
inline bool meet(const Bounds& a, const Bounds& b) {
  return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

/// Limit of coordinates [m] below which sums and differences do not overflow.
constexpr double kFarthest = 1e100;

/// A box that overlaps nothing, not even itself, and does not widen a box merged with it. It is not
/// sound.
inline const Bounds kNowhere{Vector3::Constant(kFarthest), Vector3::Constant(-kFarthest)};

/// False if a coordinate is not finite, or the sum of their absolute values is kFarthest or more.
inline bool is_sound(const Bounds& box) {
  // One comparison, which is false for NaN.
  return box.low.cwiseAbs().sum() + box.high.cwiseAbs().sum() < kFarthest;
}

/// Sweep and prune for few boxes, a grid for many of similar size, a tree for many of very
/// different sizes. Memory is kept between calls; the result does not depend on it.
class Broadphase {
 public:
  enum class Method { kAutomatic, kSweep, kGrid, kTree };

  explicit Broadphase(Method method = Method::kAutomatic);
  ~Broadphase();
  Broadphase(Broadphase&&) noexcept;
  Broadphase& operator=(Broadphase&&) noexcept;

  /// Replaces `out` by the index pairs (first < second) of boxes that overlap, ascending. A box
  /// that is not sound overlaps nothing.
  void find_pairs(const std::vector<Bounds>& boxes, std::vector<std::pair<int, int>>& out);

 private:
  struct Entry {
    double low, high;    // along the sweep axis
    double low1, high1;  // along the other two axes
    double low2, high2;
    int index;
  };
  int widest_axis() const;
  bool crowded(int axis) const;
  void sweep(int axis);
  void copy_sound(const std::vector<Bounds>& boxes);
  void sweep_or_tree(const std::vector<Bounds>& boxes);
  void move_sorted(std::size_t num_boxes, std::vector<std::pair<int, int>>& out);

  Method method_;
  std::unique_ptr<BoundsGrid> grid_;
  std::unique_ptr<BoundsTree> tree_;
  std::vector<std::pair<int, int>> found_;  // pairs, in any order
  std::vector<Bounds> boxes_;  // the given boxes, kNowhere for those that are not sound
  std::vector<Entry> entries_;
  std::vector<std::size_t> place_;  // for each box, the place of its next pair in the counting sort
};

}  // namespace counterpoint::collision
