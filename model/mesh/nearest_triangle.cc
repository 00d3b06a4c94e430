#include "counterpoint/model/mesh/nearest_triangle.h"

#include "counterpoint/model/mesh/triangle_distance.h"

namespace counterpoint {
namespace {

double squared_distance_to_box(const Vector3& p, const TriangleTree::Node& box) {
  return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

NearestTriangle::NearestTriangle(const TriangleMesh& mesh)
    : mesh_(mesh), tree_(mesh.vertices, mesh.triangles) {
  for (const int i : tree_.order) {
    const auto& t = mesh.triangles[i];
    corners_.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
  }
}

NearestTriangle::Answer NearestTriangle::find(const Vector3& p, int guess) const {
  Best best{std::numeric_limits<double>::infinity(), -1};
  if (guess >= 0) {
    const double known = distance(p, guess);
    best = {known * known, guess};
  }
  search(0, p, best);
  return {std::sqrt(best.squared), best.triangle};
}

double NearestTriangle::distance(const Vector3& p, int triangle) const {
  const auto& t = mesh_.triangles[triangle];
  return distance_to_triangle(p, mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]);
}

void NearestTriangle::search(int index, const Vector3& p, Best& best) const {
  const TriangleTree::Node& node = tree_.nodes[index];
  if (node.count > 0) {
    for (int i = node.first; i < node.first + node.count; ++i) {
      const auto& [a, b, c] = corners_[i];
      const double d = (p - nearest_on_triangle(p, a, b, c)).squaredNorm();
      if (d < best.squared) best = {d, tree_.order[i]};
    }
    return;
  }
  int first = index + 1, second = node.right;
  double to_first = squared_distance_to_box(p, tree_.nodes[first]);
  double to_second = squared_distance_to_box(p, tree_.nodes[second]);
  if (to_second < to_first) {
    std::swap(first, second);
    std::swap(to_first, to_second);
  }
  if (to_first < best.squared) search(first, p, best);
  if (to_second < best.squared) search(second, p, best);
}

}  // namespace counterpoint
