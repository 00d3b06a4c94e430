// Symmetric 6x6 inertias over (angular, linear): articulated-body inertias as three 3x3 blocks, and
// rigid-body inertias as ten parameters.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Returns skew(p) m, column by column.
inline Matrix3 cross_columns(const Vector3& p, const Matrix3& m) {
  Matrix3 out;
  for (int j = 0; j < 3; ++j) out.col(j) = p.cross(m.col(j));
  return out;
}

/// Inertia of a rigid body, or of several bodies welded together, about a point, in axes of W.
struct RigidInertia {
  double mass;         ///< [kg]
  Vector3 moment;      ///< mass times the centre of mass seen from the point [kg m]
  Matrix3 rotational;  ///< about the point, symmetric [kg m^2]

  /// Returns the inertia about the origin; `inertia` is about its centre of mass, in axes of W.
  static RigidInertia about_origin(const SpatialInertia& inertia) {
    RigidInertia I{inertia.mass, Vector3::Zero(), inertia.rotational};
    I.move(inertia.center);
    return I;
  }

  Force operator*(const Motion& v) const {
    return {rotational * v.angular + moment.cross(v.linear),
            mass * v.linear - moment.cross(v.angular)};
  }

  RigidInertia& operator+=(const RigidInertia& o) {
    mass += o.mass;
    moment += o.moment;
    rotational += o.rotational;
    return *this;
  }

  /// Moves the reference point; the old point is at p [m] from the new one. With h the moment and g
  /// = h + m p / 2 this adds 2 (g.p) 1 - g p' - p g' to `rotational`.
  void move(const Vector3& p) {
    const Vector3 g = moment + (0.5 * mass) * p;
    moment += mass * p;
    const double xx = g.x() * p.x(), yy = g.y() * p.y(), zz = g.z() * p.z();
    rotational(0, 0) += 2.0 * (yy + zz);
    rotational(1, 1) += 2.0 * (xx + zz);
    rotational(2, 2) += 2.0 * (xx + yy);
    const double xy = g.x() * p.y() + g.y() * p.x(), xz = g.x() * p.z() + g.z() * p.x(),
                 yz = g.y() * p.z() + g.z() * p.y();
    rotational(0, 1) -= xy;
    rotational(1, 0) -= xy;
    rotational(0, 2) -= xz;
    rotational(2, 0) -= xz;
    rotational(1, 2) -= yz;
    rotational(2, 1) -= yz;
  }
};

/// [torque; force] = [angular, coupling; coupling', linear] [angular velocity; linear velocity].
struct ArticulatedInertia {
  Matrix3 angular, coupling, linear;

  static ArticulatedInertia rigid(const SpatialInertia& inertia) {
    const RigidInertia about = RigidInertia::about_origin(inertia);
    return {about.rotational, skew(about.moment), inertia.mass * Matrix3::Identity()};
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

  /// Adds the inertia o of a child, about an origin at p from this one, axes unchanged
  /// (Featherstone 2008, eq. 2.66 without rotation): M, H + [p] M and I + [p] H' - (H + [p] M) [p].
  /// Written by entries, since a matrix [p] in memory is read in pairs before its entries are
  /// stored.
  void add_shifted(const ArticulatedInertia& o, const Vector3& p) {
    const double x = p.x(), y = p.y(), z = p.z();
    const Matrix3 &M = o.linear, &H = o.coupling;
    Matrix3 moved;
    for (int j = 0; j < 3; ++j) {
      moved(0, j) = H(0, j) + (y * M(2, j) - z * M(1, j));
      moved(1, j) = H(1, j) + (z * M(0, j) - x * M(2, j));
      moved(2, j) = H(2, j) + (x * M(1, j) - y * M(0, j));
    }
    const auto add = [&](int i, int j, double value) {
      angular(i, j) += o.angular(i, j) + value;
      if (i != j) angular(j, i) += o.angular(j, i) + value;
    };
    add(0, 0, y * (H(0, 2) + moved(0, 2)) - z * (H(0, 1) + moved(0, 1)));
    add(1, 1, z * (H(1, 0) + moved(1, 0)) - x * (H(1, 2) + moved(1, 2)));
    add(2, 2, x * (H(2, 1) + moved(2, 1)) - y * (H(2, 0) + moved(2, 0)));
    add(0, 1, (y * H(1, 2) - z * H(1, 1)) + (z * moved(0, 0) - x * moved(0, 2)));
    add(0, 2, (y * H(2, 2) - z * H(2, 1)) + (x * moved(0, 1) - y * moved(0, 0)));
    add(1, 2, (z * H(2, 0) - x * H(2, 2)) + (x * moved(1, 1) - y * moved(1, 0)));
    coupling += moved;
    linear += M;
  }

  Matrix6 matrix() const {
    Matrix6 m;
    m << angular, coupling, coupling.transpose(), linear;
    return m;
  }
};

}  // namespace counterpoint
