// Scalar law behind every inequality of contact: max(0, -lambda) / r, smoothed.
//
//   g(lambda) = (s - lambda) / (2 r) = 2 k / (s + lambda),      s = sqrt(lambda^2 + 4 r k)
//   g solves     r g + lambda = k / g                           g > 0 for k > 0
//   p(lambda)    p' = -g, p'' = g / s                           the convex potential of g
//
// In the limit k -> 0 it is the projection max(0, -lambda) / r, for r -> 0 the gradient k / lambda
// of a log barrier (lambda > 0 only).
#pragma once

#include <cmath>
#include <limits>

#include "counterpoint/contact/lanes/vector_lanes.h"

namespace counterpoint::contact {

/// g, its slope and s at one lambda, or at four, without cancellation on either side of zero. Real:
/// double, Four (both have the same bits) or Dual.
template <class Real>
struct ScalarLawOf {
  Real g{};  ///< impulse [N s]
  Real s{};  ///< [m/s]
  Real a{};  ///< -g' = g / s >= 0

  ScalarLawOf() = default;
  COUNTERPOINT_INTO_EACH ScalarLawOf(const Real& lambda, const Real& r, const Real& k) {
    // The maximum matters only where lambda^2 underflows.
    square_root(lambda * lambda + 4.0 * r * k, s);
    const Real size = lambda < 0.0 ? -lambda : lambda;
    s = s < size ? size : s;
    const Real above = lambda < 0.0 ? s - lambda : 2.0 * k;
    const Real below = lambda < 0.0 ? 2.0 * r : s + lambda;
    // At the corner lambda = 0, r k = 0 the slope is the mean of those on its sides.
    const Real infinite = Real{} + std::numeric_limits<double>::infinity();
    g = below > 0.0 ? above / below : (k > 0.0 ? infinite : Real{});
    a = below > 0.0 ? g / s : 0.5 / r;
  }
};
using ScalarLaw = ScalarLawOf<double>;

/// Returns p(lambda) [J] up to a constant that depends on k only.
inline double scalar_potential(double lambda, const ScalarLaw& law, double r, double k) {
  const double barrier = k > 0.0 ? k * std::log(law.g) : 0.0;
  return barrier - law.g * (0.5 * r * law.g + lambda);
}

}  // namespace counterpoint::contact
