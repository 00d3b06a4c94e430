// A tree of boxes over triangles (bounding volume hierarchy).
#pragma once

#include <array>
#include <vector>

#include "counterpoint/model/types.h"

namespace counterpoint {

struct TriangleTree {
  /// Triangles order[first ... first + count), or two children, the left one next in the array.
  struct Node {
    Vector3 low, high;
    int first = 0, count = 0;  ///< count 0: an inner node
    int right = 0;
  };
  std::vector<Node> nodes;  ///< the first holds all; at most 32 levels for any number of triangles
  std::vector<int> order;

  TriangleTree() = default;
  /// Of triangles (at least one) by their vertices [m].
  TriangleTree(const std::vector<Vector3>& vertices,
               const std::vector<std::array<int, 3>>& triangles);
};

}  // namespace counterpoint
