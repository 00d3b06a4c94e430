// Contact points of one pair of shapes, in memory of fixed size.
#pragma once

#include <array>
#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {

/// One contact point; frame and signs as in Candidate.
struct ContactPoint {
  Vector3 position;  ///< halfway between the two surface points [m]
  Vector3 normal;    ///< unit, from A to B
  double gap;        ///< signed distance along the normal [m]
};

/// Up to kCapacity contact points.
struct Manifold {
  static constexpr int kCapacity = 8;  // two faces of four corners meet in at most eight points
  std::array<ContactPoint, kCapacity> points;
  int size = 0;

  void add(const Vector3& position, const Vector3& normal, double gap) {
    if (size == kCapacity) return;
    ContactPoint& p = points[size++];
    p.position = position;
    p.normal = normal;
    p.gap = gap;
  }
  /// Adds the contact of two balls (radii [m], may be 0) about core_a and core_b if its gap is
  /// below the margin. `fallback`: unit normal used where the centres coincide.
  void add_round(const Vector3& core_a, double radius_a, const Vector3& core_b, double radius_b,
                 const Vector3& fallback, double margin) {
    const Vector3 d = core_b - core_a;
    const double distance = d.norm();
    const double gap = distance - radius_a - radius_b;
    if (!(gap < margin)) return;
    const Vector3 normal = distance > 0.0 ? Vector3(d / distance) : fallback;
    add(0.5 * (core_a + core_b + normal * (radius_a - radius_b)), normal, gap);
  }
};

}  // namespace counterpoint::collision
