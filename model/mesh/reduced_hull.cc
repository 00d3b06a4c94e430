// reduce_hull: chooses vertices of a hull greedily, each time the one farthest outside.
#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mesh/hull_distance.h"

namespace counterpoint {
namespace {

/// Index of the point with the largest value.
template <typename Value>
int most(const std::vector<Vector3>& points, const Value& value) {
  int best = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    if (value(points[i]) > value(points[best])) best = static_cast<int>(i);
  }
  return best;
}

/// Four vertices that span a large tetrahedron, chosen greedily.
std::vector<Vector3> first_tetrahedron(const std::vector<Vector3>& points) {
  const Vector3 a = points[most(points, [](const Vector3& p) { return p.x(); })];
  const Vector3 b = points[most(points, [&](const Vector3& p) { return (p - a).squaredNorm(); })];
  const Vector3 c =
      points[most(points, [&](const Vector3& p) { return (p - a).cross(b - a).squaredNorm(); })];
  const Vector3 normal = (b - a).cross(c - a);
  const Vector3 d =
      points[most(points, [&](const Vector3& p) { return std::abs(normal.dot(p - a)); })];
  return {a, b, c, d};
}

}  // namespace

std::shared_ptr<const ConvexMesh> reduce_hull(const std::shared_ptr<const ConvexMesh>& hull,
                                              int max_vertices) {
  if (max_vertices < 4) {
    throw InputError(
        fmt::format("{}: a hull of {} vertices; it needs at least 4", hull->source, max_vertices));
  }
  if (static_cast<int>(hull->vertices.size()) <= max_vertices && hull->pieces.empty()) return hull;
  std::vector<Vector3> chosen = first_tetrahedron(hull->vertices);
  std::shared_ptr<const ConvexMesh> reduced = make_convex_hull(chosen, hull->source);
  while (chosen.size() < std::min<size_t>(max_vertices, hull->vertices.size())) {
    chosen.push_back(hull->vertices[most(hull->vertices,
                                         [&](const Vector3& p) { return excess(*reduced, p); })]);
    reduced = make_convex_hull(chosen, hull->source);
  }
  ConvexMesh out = *reduced;
  out.source_volume = hull->source_volume;
  out.standoff = hull->standoff;
  out.union_standoff = hull->union_standoff;
  out.hull_reason = hull->hull_reason;
  for (const auto& piece : hull->pieces) out.pieces.push_back(reduce_hull(piece, max_vertices));
  for (const Vector3& p : hull->vertices) {
    out.deviation = std::max(out.deviation, distance_outside(out, p));
  }
  return std::make_shared<const ConvexMesh>(std::move(out));
}

bool is_visibly_concave(const ConvexMesh& hull) {
  constexpr double kVolume = 1.05;
  constexpr double kStandoff = 0.05;  // relative to the hull's diameter
  return (hull.source_volume > 0.0 && hull.volume > kVolume * hull.source_volume) ||
         hull.standoff > kStandoff * 2.0 * hull.radius;
}

std::string hull_note(const ConvexMesh& hull) {
  if (!is_visibly_concave(hull)) return "";
  const std::string volume =
      hull.source_volume > 0.0
          ? fmt::format("has {:.3g} times the volume and ", hull.volume / hull.source_volume)
          : "";
  if (!hull.pieces.empty()) {
    return fmt::format(
        "is concave: it collides as {} convex pieces, whose surface stands up to {:.2g} m off it "
        "(its hull: {:.2g} m)",
        hull.pieces.size(), hull.union_standoff, hull.standoff);
  }
  return fmt::format(
      "is concave: its convex hull, which is used{}, {}stands up to {:.2g} m off it; where that "
      "matters, let it collide as pieces (meshes: {{tolerance: m}} in a scene, --mesh-tolerance); "
      "what never moves keeps its triangles as triangle_mesh under environment of a scene file",
      hull.hull_reason.empty() ? "" : " since " + hull.hull_reason, volume, hull.standoff);
}

}  // namespace counterpoint
