// A ray against a static triangle mesh: only front faces are hit.
#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/rays/ray.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::collision {
namespace {

// True if the ray meets the box before `limit`, or if a comparison involves NaN (0 / 0 on a face).
bool meets(const TriangleTree::Node& box, const Vector3& origin, const Vector3& direction,
           double limit) {
  double enter = 0.0;
  double exit = limit;
  for (int i = 0; i < 3; ++i) {
    double first = (box.low[i] - origin[i]) / direction[i];
    double second = (box.high[i] - origin[i]) / direction[i];
    if (first > second) std::swap(first, second);
    if (first > enter) enter = first;
    if (second < exit) exit = second;
  }
  // The slack keeps round-off from letting a ray slip between box and triangle.
  return enter <= exit + 1e-9 * (1.0 + std::abs(exit));
}

// The side of a triangle that a ray sees.
enum class Shows : unsigned char { kFront, kBack };

// Returns the ray parameter where it crosses a triangle that shows this side; infinity if it does
// not. Uses the signed volumes of the ray with each edge: neighbours compute the same number, so no
// ray passes between them.
double hit(const Terrain& terrain, const Terrain::Triangle& t, const Vector3& origin,
           const Vector3& direction, Shows shows) {
  const double slope = t.normal.dot(direction);
  if (!(shows == Shows::kFront ? slope < 0.0 : slope > 0.0)) return kInfinity;
  for (int k = 0; k < 3; ++k) {
    int from = t.vertices[k];
    int to = t.vertices[(k + 1) % 3];
    const double sign = (from < to) == (shows == Shows::kFront) ? 1.0 : -1.0;
    if (from > to) std::swap(from, to);
    const Vector3 p = terrain.vertices[from] - origin;
    const Vector3 q = terrain.vertices[to] - origin;
    if (sign * p.cross(q).dot(direction) > 0.0) return kInfinity;
  }
  return t.normal.dot(terrain.vertices[t.vertices[0]] - origin) / slope;
}

// A triangle, and the ray parameter where the ray crosses it; -1 for none.
struct Crossing {
  int triangle = -1;
  double at = kInfinity;
};

// Returns the first crossing within max_distance.
Crossing first_crossing(const Terrain& terrain, const Vector3& origin, const Vector3& direction,
                        double max_distance, Shows shows) {
  double nearest = kInfinity;
  int found = -1;
  std::array<int, 64> stack;  // deeper than any tree (TriangleTree)
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const int index = stack[--size];
    const TriangleTree::Node& node = terrain.tree.nodes[index];
    if (!meets(node, origin, direction, std::min(nearest, max_distance))) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const int t = terrain.tree.order[i];
      const double at = hit(terrain, terrain.triangles[t], origin, direction, shows);
      if (at < 0.0 || at > max_distance) continue;
      if (at < nearest || (at == nearest && t < found)) {
        nearest = at;
        found = t;
      }
    }
    if (node.count > 0) continue;
    stack[size++] = node.right;
    stack[size++] = index + 1;
  }
  return {found, nearest};
}

}  // namespace

std::optional<RayHit> cast_terrain_ray(const Terrain& terrain, const Vector3& origin,
                                       const Vector3& direction, double max_distance) {
  const Crossing first = first_crossing(terrain, origin, direction, max_distance, Shows::kFront);
  if (first.triangle < 0) return std::nullopt;
  return RayHit{first.at, origin + first.at * direction, terrain.triangles[first.triangle].normal};
}

bool is_behind(const Terrain& terrain, const Vector3& point, const Vector3& direction,
               double max_distance) {
  const Crossing back = first_crossing(terrain, point, direction, max_distance, Shows::kBack);
  return back.triangle >= 0 &&
         first_crossing(terrain, point, direction, back.at, Shows::kFront).triangle < 0;
}

}  // namespace counterpoint::collision
