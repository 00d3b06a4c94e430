// Points between a piece's hull and the solid.
#include "counterpoint/model/mesh/hull_distance.h"
#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

// Largest distance of the points from each other on a hull, relative to its radius, unless the
// tolerance is larger; their number; and that of points one below the other.
constexpr double kSpacing = 0.1;
constexpr std::size_t kMostPoints = 300;
constexpr int kMostBelow = 4;

/// Halves a triangle across its longest edge.
std::array<Corners3, 2> halves(const Corners3& t) {
  int k = 0;
  for (int i = 1; i < 3; ++i)
    if ((t[(i + 1) % 3] - t[i]).norm() > (t[(k + 1) % 3] - t[k]).norm()) k = i;
  std::array<Corners3, 2> out{t, t};
  out[0][k] = out[1][(k + 1) % 3] = 0.5 * (t[k] + t[(k + 1) % 3]);
  return out;
}

}  // namespace

std::vector<Vector3> far_points(const Solid& solid, const Piece& piece) {
  std::vector<Vector3> out{piece.farthest};
  const ConvexMesh& hull = *piece.hull;
  const double spacing = std::max(solid.tolerance, kSpacing * hull.radius);
  std::vector<Corners3> open;
  for (const std::vector<int>& face : hull.faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      open.push_back({hull.vertices[face[0]], hull.vertices[face[i - 1]], hull.vertices[face[i]]});
  while (!open.empty() && out.size() < kMostPoints) {
    const Corners3 t = open.back();
    open.pop_back();
    Vector3 p = (t[0] + t[1] + t[2]) / 3.0;
    double reach = 0.0;
    for (const Vector3& corner : t) reach = std::max(reach, (corner - p).norm());
    double distance = solid.distance(p);
    if (distance + reach <= solid.tolerance) continue;
    if (reach > spacing) {
      for (const Corners3& half : halves(t)) open.push_back(half);
      continue;
    }
    const Vector3 inwards = -(t[1] - t[0]).cross(t[2] - t[0]).normalized();
    for (int k = 0; k < kMostBelow && distance > solid.tolerance; ++k) {
      out.push_back(p);
      p += 2.0 * spacing * inwards;
      if (excess(hull, p) > 0.0) break;
      distance = solid.distance(p);
    }
  }
  return out;
}

}  // namespace counterpoint::pieces
