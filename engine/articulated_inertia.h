// A 6x6 symmetric inertia over (angular, linear), as three 3x3 blocks: rigid, composite or articulated.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// [torque; force] = [angular, coupling; coupling', linear] [angular velocity; linear velocity].
struct ArticulatedInertia {
  Matrix3 angular, coupling, linear;

  static ArticulatedInertia rigid(const SpatialInertia& inertia) {
    const Matrix3 s = skew(inertia.center);
    ArticulatedInertia I;
    I.coupling = inertia.mass * s;
    I.angular = inertia.rotational - I.coupling * s;
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

  /// The same inertia seen from frame P, this being expressed in B (Featherstone 2008, eq. 2.66).
  ArticulatedInertia transformed(const Pose& X_PB) const {
    const Matrix3& R = X_PB.rotation;
    const Matrix3 p = skew(X_PB.translation);
    ArticulatedInertia out;
    out.linear = R * linear * R.transpose();
    const Matrix3 H = R * coupling * R.transpose();
    out.coupling = H + p * out.linear;
    // I + [p] H' - (H + [p] M) [p], symmetric by construction up to round-off.
    out.angular = R * angular * R.transpose() + p * H.transpose() - out.coupling * p;
    return out;
  }

  Matrix6 matrix() const {
    Matrix6 m;
    m << angular, coupling, coupling.transpose(), linear;
    return m;
  }
};

}  // namespace counterpoint
