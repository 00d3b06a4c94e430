#include "counterpoint/collision/pairs/seams.h"

#include <algorithm>
#include <limits>

namespace counterpoint::collision {
namespace {

// Relative to a piece's radius: the accuracy of its corners (coplanar faces are merged).
constexpr double kRounding = 2e-6;
// Relative to the neighbour's radius: a face is hidden where the neighbour covers it this deep,
// since less would take the support of a body away that is pressed into a corner between two
// pieces; the surfaces of two pieces meet at a seam if they are nearer than this.
constexpr double kCovered = 1e-2;

// Returns the height of p over the plane of a face [m].
double height_over(const ConvexMesh& mesh, std::size_t face, const Vector3& p) {
  return mesh.face_normals[face].dot(p) - mesh.face_offsets[face];
}

// Returns whether p is behind all faces, each moved outwards by `distance` [m].
bool is_within(const ConvexMesh& mesh, const Vector3& p, double distance) {
  for (std::size_t f = 0; f < mesh.face_normals.size(); ++f)
    if (height_over(mesh, f, p) > distance) return false;
  return true;
}

// Returns the face of a mesh farthest in front of which p lies.
std::size_t facing(const ConvexMesh& mesh, const Vector3& p) {
  std::size_t best = 0;
  for (std::size_t f = 1; f < mesh.face_normals.size(); ++f)
    if (height_over(mesh, f, p) > height_over(mesh, best, p)) best = f;
  return best;
}

// Returns whether a vertex reaches `height` [m] along n.
bool rises_to(const ConvexMesh& mesh, const Vector3& n, double height) {
  return std::any_of(mesh.vertices.begin(), mesh.vertices.end(),
                     [&](const Vector3& v) { return n.dot(v) >= height; });
}

double reach(const ConvexMesh& mesh, const Vector3& n) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Vector3& v : mesh.vertices) most = std::max(most, n.dot(v));
  return most;
}

}  // namespace

Seams::Seams(const std::vector<Geometry>& geometries)
    : meshes_(geometries.size()), neighbors_(geometries.size()) {
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    meshes_[i] = geometries[i].shape.mesh.get();
    if (geometries[i].whole < 0) continue;
    const ConvexMesh& a = *geometries[i].shape.mesh;
    const auto first = static_cast<std::size_t>(geometries[i].whole);
    for (std::size_t k = first; k < geometries.size() && geometries[k].whole >= 0; ++k) {
      if (k == i || geometries[k].whole != geometries[i].whole) continue;
      const ConvexMesh& b = *geometries[k].shape.mesh;
      const double apart = (a.interior_point - b.interior_point).norm() - a.radius - b.radius;
      if (apart >= a.union_standoff) continue;
      const double rounding = kRounding * std::max(a.radius, b.radius);
      const double deep = kCovered * b.radius;
      const double seam = std::max(std::min(a.union_standoff, deep), rounding);
      const double reach = b.radius + seam;
      neighbors_[i].push_back(
          {&b, b.interior_point, reach * reach, deep, seam, rounding, facing(b, a.interior_point)});
    }
  }
}

bool Seams::hides(int geometry, const Vector3& p, const Vector3& n) const {
  const ConvexMesh& mesh = *meshes_[geometry];
  for (const Neighbor& near : neighbors_[geometry]) {
    const ConvexMesh& other = *near.mesh;
    if ((p - near.center).squaredNorm() > near.reach_square ||
        height_over(other, near.facing, p) > near.seam || !is_within(other, p, near.seam) ||
        !rises_to(other, n, n.dot(p) + near.rounding))
      continue;
    // The neighbour rises beyond p. A feature that leads away from it may touch all the same: in a
    // groove between two pieces both sides do.
    const double top = reach(mesh, n) - near.rounding;
    const bool leads_away = std::any_of(
        mesh.vertices.begin(), mesh.vertices.end(),
        [&](const Vector3& v) { return n.dot(v) > top && !is_within(other, v, near.seam); });
    if (!leads_away || is_within(other, p + 2.0 * near.deep * n, -near.deep)) return true;
  }
  return false;
}

bool Seams::is_near(int geometry, const Vector3& p, double reach) const {
  return std::any_of(neighbors_[geometry].begin(), neighbors_[geometry].end(),
                     [&](const Neighbor& other) { return is_within(*other.mesh, p, reach); });
}

}  // namespace counterpoint::collision
