// Derivative of the exponential map of rotations.
#pragma once

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Returns the right Jacobian J_r: exp(r + dr) = exp(r) exp(J_r dr) to first order. The left
/// Jacobian is J_l = J_r'.
inline Matrix3 right_jacobian(const Vector3& r) {
  const double angle2 = r.squaredNorm();
  // (1 - cos a) / a^2 and (a - sin a) / a^3; for small angles series with a remainder below
  // round-off.
  double b = 0.0, c = 0.0;
  if (angle2 > 1e-3) {
    const double angle = std::sqrt(angle2), half = std::sin(0.5 * angle);
    b = 2.0 * half * half / angle2;
    c = (angle - std::sin(angle)) / (angle2 * angle);
  } else {
    b = 0.5 - angle2 * (1.0 / 24 - angle2 * (1.0 / 720 - angle2 / 40320));
    c = 1.0 / 6 - angle2 * (1.0 / 120 - angle2 * (1.0 / 5040 - angle2 / 362880));
  }
  const Matrix3 s = skew(r);
  return Matrix3::Identity() - b * s + c * s * s;
}

}  // namespace counterpoint
