#include <algorithm>
#include <limits>
#include <numeric>

#include "counterpoint/model/geometry.h"

namespace counterpoint {
namespace {

constexpr int kLeafSize = 4;

/// Builds the tree depth first; splits at the median centroid along the axis of widest spread.
class TreeBuilder {
 public:
  TreeBuilder(const std::vector<Vector3>& vertices,
              const std::vector<std::array<int, 3>>& triangles, TriangleTree& out)
      : vertices_(vertices), triangles_(triangles), out_(out) {}

  int build(int first, int count) {
    const int index = static_cast<int>(out_.nodes.size());
    out_.nodes.emplace_back();
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 high = -low;
    Vector3 center_low = low;
    Vector3 center_high = high;
    for (int i = first; i < first + count; ++i) {
      for (const int v : triangles_[out_.order[i]]) {
        low = low.cwiseMin(vertices_[v]);
        high = high.cwiseMax(vertices_[v]);
      }
      const Vector3 center = center_of(out_.order[i]);
      center_low = center_low.cwiseMin(center);
      center_high = center_high.cwiseMax(center);
    }
    out_.nodes[index].low = low;
    out_.nodes[index].high = high;
    if (count <= kLeafSize) {
      out_.nodes[index].first = first;
      out_.nodes[index].count = count;
      return index;
    }
    int axis = 0;
    (center_high - center_low).maxCoeff(&axis);
    const int half = count / 2;
    const auto begin = out_.order.begin() + first;
    std::nth_element(begin, begin + half, begin + count, [&](int a, int b) {
      const double ca = center_of(a)[axis];
      const double cb = center_of(b)[axis];
      return ca != cb ? ca < cb : a < b;
    });
    build(first, half);
    const int right = build(first + half, count - half);
    out_.nodes[index].right = right;
    return index;
  }

 private:
  Vector3 center_of(int t) const {
    const auto& v = triangles_[t];
    return (vertices_[v[0]] + vertices_[v[1]] + vertices_[v[2]]) / 3.0;
  }

  const std::vector<Vector3>& vertices_;
  const std::vector<std::array<int, 3>>& triangles_;
  TriangleTree& out_;
};

}  // namespace

TriangleTree::TriangleTree(const std::vector<Vector3>& vertices,
                           const std::vector<std::array<int, 3>>& triangles)
    : order(triangles.size()) {
  std::iota(order.begin(), order.end(), 0);
  TreeBuilder(vertices, triangles, *this).build(0, static_cast<int>(order.size()));
}

}  // namespace counterpoint
