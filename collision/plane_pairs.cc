// A half-space against everything: the gap of a point is its height above the plane.
#include <algorithm>
#include <array>
#include <limits>

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

// Four points a rim, the lowest one and every quarter turn from it. A cylinder standing upright has no
// lowest point: there the square starts at its own x axis, and since the second moments of a square
// are the same about every axis, the turn of the square does not change how it carries load.
void plane_cylinder(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    double margin, Manifold& out) {
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

// All vertices within the margin, or eight that span them: the lowest, then always the one farthest,
// along the plane, from those chosen.
void plane_convex_mesh(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                       double margin, Manifold& out) {
  const Plane plane(X_WA);
  const Vector3 up = X_WB.rotation.transpose() * plane.normal;
  const double center = plane.height(X_WB.translation);
  const std::vector<Vector3>& vertices = b.mesh->vertices;
  const int size = static_cast<int>(vertices.size());
  const auto height = [&](int i) { return center + up.dot(vertices[i]); };
  int within = 0;
  int next = 0;
  for (int i = 0; i < size; ++i) {
    const double h = height(i);
    within += h < margin;
    if (h < height(next)) next = i;
  }
  if (within <= Manifold::kCapacity) {
    for (int i = 0; i < size && within > 0; ++i) plane.add(X_WB * vertices[i], margin, out);
    return;
  }
  std::array<int, Manifold::kCapacity> chosen{};
  for (int n = 0; n < Manifold::kCapacity; ++n) {
    chosen[n] = next;
    plane.add(X_WB * vertices[next], margin, out);
    double farthest = -1.0;
    for (int i = 0; i < size; ++i) {
      if (height(i) >= margin) continue;
      double distance2 = std::numeric_limits<double>::infinity();
      for (int k = 0; k <= n; ++k) {
        const Vector3 d = vertices[i] - vertices[chosen[k]];
        const double along = d.dot(up);
        distance2 = std::min(distance2, d.squaredNorm() - along * along);
      }
      if (distance2 > farthest) {
        farthest = distance2;
        next = i;
      }
    }
  }
}

}  // namespace counterpoint::collision
