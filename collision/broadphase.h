// Pairs of boxes that overlap.
#pragma once

#include <utility>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {

/// An axis-aligned box in W [m].
struct Bounds {
  Vector3 low, high;
};

/// Sweep and prune along the axis on which the boxes are spread most. Keeps its memory from call to
/// call, nothing else.
class Broadphase {
 public:
  /// Appends the index pairs (first < second) of boxes that overlap, in no particular but always the
  /// same order.
  void find_pairs(const std::vector<Bounds>& boxes, std::vector<std::pair<int, int>>& out);

 private:
  struct Entry {
    double low, high;    // along the sweep
    double low1, high1;  // along the other two axes
    double low2, high2;
    int index;
  };
  std::vector<Entry> entries_;
};

}  // namespace counterpoint::collision
