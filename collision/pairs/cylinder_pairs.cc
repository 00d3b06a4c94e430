// A sphere against a cylinder: the closest point of the cylinder to the sphere's centre.
#include <algorithm>
#include <cmath>

#include "counterpoint/collision/pairs/pair_functions.h"

namespace counterpoint::collision {

void sphere_cylinder(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                     const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Vector3 center = X_WB.rotation.transpose() * (X_WA.translation - X_WB.translation);
  const double radius = b.size[0];
  const double half = b.size[1];
  const double radial = std::sqrt(center.x() * center.x() + center.y() * center.y());
  if (radial > radius || std::abs(center.z()) > half) {
    const double scale = radial > radius ? radius / radial : 1.0;
    const Vector3 closest(center.x() * scale, center.y() * scale,
                          std::clamp(center.z(), -half, half));
    out.add_round(X_WA.translation, a.size[0], X_WB * closest, 0.0, Vector3::UnitZ(), margin);
    return;
  }
  // The centre is inside: the way out is through the side or the nearer cap, whichever is closer.
  Vector3 outward(0.0, 0.0, center.z() < 0.0 ? -1.0 : 1.0);
  double depth = half - std::abs(center.z());
  if (radius - radial < depth) {
    depth = radius - radial;
    outward = radial > 0.0 ? Vector3(center.x() / radial, center.y() / radial, 0.0)
                           : Vector3(1.0, 0.0, 0.0);
  }
  const double gap = -depth - a.size[0];
  if (gap >= margin) return;
  const Vector3 normal = -(X_WB.rotation * outward);
  out.add(X_WA.translation + (a.size[0] + 0.5 * gap) * normal, normal, gap);
}

}  // namespace counterpoint::collision
