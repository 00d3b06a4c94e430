#include "counterpoint/model/mesh/nearest_triangle.h"

#include "counterpoint/model/mesh/triangle_distance.h"

namespace counterpoint {
namespace {

double distance_to_box(const Vector3& p, const TriangleTree::Node& box) {
  return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).norm();
}

}  // namespace

NearestTriangle::Answer NearestTriangle::find(const Vector3& p, int guess) const {
  Answer best;
  if (guess >= 0) best = {distance(p, guess), guess};
  search(0, p, best);
  return best;
}

double NearestTriangle::distance(const Vector3& p, int triangle) const {
  const auto& t = mesh_.triangles[triangle];
  return distance_to_triangle(p, mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]);
}

void NearestTriangle::search(int index, const Vector3& p, Answer& best) const {
  const TriangleTree::Node& node = tree_.nodes[index];
  if (node.count > 0) {
    for (int i = node.first; i < node.first + node.count; ++i) {
      const double d = distance(p, tree_.order[i]);
      if (d < best.distance) best = {d, tree_.order[i]};
    }
    return;
  }
  int first = index + 1, second = node.right;
  double to_first = distance_to_box(p, tree_.nodes[first]);
  double to_second = distance_to_box(p, tree_.nodes[second]);
  if (to_second < to_first) {
    std::swap(first, second);
    std::swap(to_first, to_second);
  }
  if (to_first < best.distance) search(first, p, best);
  if (to_second < best.distance) search(second, p, best);
}

}  // namespace counterpoint
