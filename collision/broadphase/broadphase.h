// Pairs of boxes that overlap.
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

/// No sum or difference of coordinates up to this many metres overflows.
constexpr double kFarthest = 1e100;

/// What overlaps nothing, not even itself, and widens nothing it is merged with. Not sound.
inline const Bounds kNowhere{Vector3::Constant(kFarthest), Vector3::Constant(-kFarthest)};

/// False if a coordinate is not finite, or all together are beyond kFarthest.
inline bool is_sound(const Bounds& box) {
  // One comparison, which is false for what is not a number.
  return box.low.cwiseAbs().sum() + box.high.cwiseAbs().sum() < kFarthest;
}

/// Sweep and prune for few boxes, a grid for many of like size, a tree for many of very different
/// sizes. Keeps its memory from call to call; the result does not depend on it.
class Broadphase {
 public:
  enum class Method { kAutomatic, kSweep, kGrid, kTree };

  explicit Broadphase(Method method = Method::kAutomatic);
  ~Broadphase();
  Broadphase(Broadphase&&) noexcept;
  Broadphase& operator=(Broadphase&&) noexcept;

  /// Replaces `out` by the index pairs (first < second) of boxes that overlap, ascending. A box
  /// that is not sound meets nothing.
  void find_pairs(const std::vector<Bounds>& boxes, std::vector<std::pair<int, int>>& out);

 private:
  struct Entry {
    double low, high;    // along the sweep
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
  std::vector<std::pair<int, int>> found_;  // in any order
  std::vector<Bounds> boxes_;               // those given, sound ones
  std::vector<Entry> entries_;
  std::vector<std::size_t> place_;  // where the next pair of a box goes
};

}  // namespace counterpoint::collision
