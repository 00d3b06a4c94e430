// Pairs of boxes that overlap.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {

class BoundsTree;

/// An axis-aligned box in W [m].
struct Bounds {
  Vector3 low, high;
};

/// False if a coordinate is not finite, or beyond 1e100 m.
bool is_sound(const Bounds& box);

/// Sweep and prune for scenes that are small or stretched out, a tree for the others. Keeps its memory
/// from call to call; which pairs are found does not depend on it, their order does.
class Broadphase {
 public:
  enum class Method { kAutomatic, kSweep, kTree };

  explicit Broadphase(Method method = Method::kAutomatic);
  ~Broadphase();
  Broadphase(Broadphase&&) noexcept;
  Broadphase& operator=(Broadphase&&) noexcept;

  /// Replaces `out` by the index pairs (first < second) of boxes that overlap, in any order. A
  /// box that is not sound meets nothing.
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
  void sweep(int axis, std::vector<std::pair<int, int>>& out);

  Method method_;
  std::unique_ptr<BoundsTree> tree_;
  std::vector<Bounds> boxes_;  // those given, sound ones
  std::vector<Entry> entries_;
};

}  // namespace counterpoint::collision
