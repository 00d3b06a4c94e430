// Torque-free rotation of a rigid body in closed form (Euler's top).
#pragma once

#include "counterpoint/model/model.h"

namespace counterpoint {

/// A rigid body that rotates about its centre of mass or about a fixed point.
class EulerTop {
 public:
  /// `inertia`: symmetric, positive semidefinite [kg m^2], about the centre of mass or the fixed
  /// point, in body axes.
  explicit EulerTop(const Matrix3& inertia) : principal_(principal_axes(inertia)) {}

  /// Returns the angular velocity in body axes [rad/s] h seconds after `omega` (in body axes)
  /// without torque. Energy and the magnitude of the angular momentum are conserved to round-off,
  /// for any rotation within h. Returns omega unchanged if two moments vanish (a rod).
  ///
  /// Source: Landau & Lifshitz, Mechanics, section 37, with the addition theorems of Jacobi's
  /// functions (Abramowitz & Stegun 16.17): this needs no phase and no division by quantities that
  /// vanish for symmetric bodies.
  Vector3 advance(const Vector3& omega, double h) const;

  /// Change of angular velocity [rad/s] due to an angular impulse [N m s], both in body axes.
  Vector3 response(const Vector3& impulse) const {
    const auto& [moments, axes] = principal_;
    return axes * (axes.transpose() * impulse).cwiseQuotient(moments);
  }

 private:
  PrincipalAxes principal_;
};

/// Jacobi's elliptic functions at u for the parameter m = 1 - m1, 0 <= m1 <= 1, by the
/// arithmetic-geometric mean (Abramowitz & Stegun 16.4).
struct JacobiFunctions {
  double sn, cn, dn;
};
JacobiFunctions jacobi_functions(double u, double m1);

}  // namespace counterpoint
