// A 6x6 symmetric inertia over (angular, linear), as three 3x3 blocks: rigid, composite or
// articulated.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// skew(p) * m, column by column.
inline Matrix3 cross_columns(const Vector3& p, const Matrix3& m) {
  Matrix3 out;
  for (int j = 0; j < 3; ++j) out.col(j) = p.cross(m.col(j));
  return out;
}

/// [torque; force] = [angular, coupling; coupling', linear] [angular velocity; linear velocity].
struct ArticulatedInertia {
  Matrix3 angular, coupling, linear;

  static ArticulatedInertia rigid(const SpatialInertia& inertia) {
    const Matrix3 s = skew(inertia.center);
    ArticulatedInertia I;
    I.coupling = inertia.mass * s;
    I.angular = inertia.rotational - cross_columns(inertia.center, I.coupling);
    I.linear = inertia.mass * Matrix3::Identity();
    return I;
  }

  Force operator*(const Motion& v) const {
    return {angular * v.angular + coupling * v.linear,
            coupling.transpose() * v.angular + linear * v.linear};
  }

  ArticulatedInertia& operator+=(const ArticulatedInertia& o) {
    angular += o.angular;
    coupling += o.coupling;
    linear += o.linear;
    return *this;
  }

  /// The same inertia about a point from which this one's origin is seen at p, axes unchanged
  /// (Featherstone 2008, eq. 2.66 without rotation).
  ArticulatedInertia shifted(const Vector3& p) const {
    ArticulatedInertia out;
    out.linear = linear;
    out.coupling = coupling + cross_columns(p, linear);
    // I + [p] H' - (H + [p] M) [p], and X [p] = -([p] X')'.
    const Matrix3 transposed = coupling.transpose(), moved = out.coupling.transpose();
    out.angular = angular + cross_columns(p, transposed) + cross_columns(p, moved).transpose();
    return out;
  }

  Matrix6 matrix() const {
    Matrix6 m;
    m << angular, coupling, coupling.transpose(), linear;
    return m;
  }
};

}  // namespace counterpoint
