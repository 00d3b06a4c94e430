// A half-space against everything: the gap of a point is its height above the plane.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "counterpoint/collision/core_shape.h"
#include "counterpoint/collision/pair_functions.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint::collision {
namespace {

// The plane z = 0 of its frame.
struct Plane {
  explicit Plane(const Pose& X) : normal(X.rotation.col(2)), origin(X.translation) {}
  double height(const Vector3& p) const { return normal.dot(p - origin); }
  // Adds surface point p of the other shape.
  void add(const Vector3& p, double margin, Manifold& out) const {
    const double gap = height(p);
    if (gap < margin) out.add(p - (0.5 * gap) * normal, normal, gap);
  }
  Vector3 normal, origin;
};

}  // namespace

void plane_sphere(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin,
                  Manifold& out) {
  const Plane plane(X_WA);
  plane.add(X_WB.translation - b.size[0] * plane.normal, margin, out);
}

void plane_capsule(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin,
                   Manifold& out) {
  const Plane plane(X_WA);
  const Vector3 half = b.size[1] * X_WB.rotation.col(2);
  const Vector3 low = X_WB.translation - b.size[0] * plane.normal;
  plane.add(low - half, margin, out);
  plane.add(low + half, margin, out);
}

// All eight corners are candidates, not only those of the lowest face: no choice, no jump.
void plane_box(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin,
               Manifold& out) {
  const Plane plane(X_WA);
  const double center = plane.height(X_WB.translation);
  const Vector3 rise = (X_WB.rotation.transpose() * plane.normal).cwiseProduct(b.size);
  if (center - rise.cwiseAbs().sum() >= margin) return;
  for (int i = 0; i < 8; ++i) {
    const Vector3 sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
    const double gap = center + sign.dot(rise);
    if (gap >= margin) continue;
    const Vector3 corner = X_WB.translation + X_WB.rotation * sign.cwiseProduct(b.size);
    out.add(corner - (0.5 * gap) * plane.normal, plane.normal, gap);
  }
}

// Four points a rim, the lowest one and every quarter turn from it. A cylinder standing upright has
// no lowest point: there the square starts at its own x axis, and since the second moments of a
// square are the same about every axis, the turn of the square does not change how it carries load.
void plane_cylinder(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin,
                    Manifold& out) {
  const Plane plane(X_WA);
  const Vector3 axis = X_WB.rotation.col(2);
  Vector3 down = axis * axis.dot(plane.normal) - plane.normal;
  const double length = down.norm();
  // Below round-off of the rotation the direction is noise.
  down = length > 1e-14 ? Vector3(down / length) : Vector3(X_WB.rotation.col(0));
  const Vector3 side = b.size[0] * axis.cross(down);
  down *= b.size[0];
  for (const double end : {-1.0, 1.0}) {
    const Vector3 cap = X_WB.translation + (end * b.size[1]) * axis;
    plane.add(cap + down, margin, out);
    plane.add(cap + side, margin, out);
    plane.add(cap - down, margin, out);
    plane.add(cap - side, margin, out);
  }
}

namespace {

// The vertices of a mesh seen from a plane.
struct Heights {
  const ConvexMesh& mesh;
  Vector3 up;  // in the frame of the mesh
  double center, margin;

  double at(int i) const { return center + up.dot(mesh.vertices[i]); }
  bool within(int i) const { return at(i) < margin; }
};

constexpr int kPatch = 32;

// Lists the vertices within the margin, ascending, by walking over the edges from the lowest: those
// of a convex mesh hang together. Returns their number, or kPatch + 1 if they are more.
int list_within(const Heights& heights, int lowest, std::array<int, kPatch>& list) {
  int size = 0;
  list[size++] = lowest;
  for (int k = 0; k < size; ++k) {
    for (const int i : heights.mesh.vertex_neighbors[list[k]]) {
      if (!heights.within(i) ||
          std::find(list.begin(), list.begin() + size, i) != list.begin() + size) {
        continue;
      }
      if (size == kPatch) return kPatch + 1;
      list[size++] = i;
    }
  }
  std::sort(list.begin(), list.begin() + size);
  return size;
}

// Those of the vertices within the margin that lie farthest along seven directions in the plane,
// which turn with the mesh. By place only: heights are noise where a body rests. Returns their
// number.
int choose_spanning(const Heights& heights, std::array<int, Manifold::kCapacity>& chosen) {
  constexpr int kDirections = Manifold::kCapacity - 1;
  const Matrix3 frame = frame_from_normal(heights.up);
  const std::vector<Vector3>& vertices = heights.mesh.vertices;
  int n = 0;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 0.1 + 2.0 * std::numbers::pi / kDirections * k;
    const Vector3 direction = std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1);
    double farthest = -std::numeric_limits<double>::infinity();
    int best = -1;
    for (int i = 0; i < static_cast<int>(vertices.size()); ++i) {
      if (!heights.within(i) || direction.dot(vertices[i]) <= farthest) continue;
      farthest = direction.dot(vertices[i]);
      best = i;
    }
    if (std::find(chosen.begin(), chosen.begin() + n, best) == chosen.begin() + n)
      chosen[n++] = best;
  }
  return n;
}

}  // namespace

// All vertices within the margin, or seven that span them and the lowest.
void plane_convex_mesh(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                       double margin, Manifold& out) {
  const Plane plane(X_WA);
  const Heights heights{*b.mesh, X_WB.rotation.transpose() * plane.normal,
                        plane.height(X_WB.translation), margin};
  const int lowest = support_vertex(*b.mesh, -heights.up, 0);
  if (!heights.within(lowest)) return;
  const auto add = [&](int i) { plane.add(X_WB * b.mesh->vertices[i], margin, out); };
  std::array<int, kPatch> list;
  const int size = list_within(heights, lowest, list);
  if (size <= Manifold::kCapacity) {
    std::for_each(list.begin(), list.begin() + size, add);
    return;
  }
  std::array<int, Manifold::kCapacity> chosen;
  const int n = choose_spanning(heights, chosen);
  std::for_each(chosen.begin(), chosen.begin() + n, add);
  if (std::find(chosen.begin(), chosen.begin() + n, lowest) == chosen.begin() + n) add(lowest);
}

}  // namespace counterpoint::collision
