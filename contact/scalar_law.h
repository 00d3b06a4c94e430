// The one scalar function behind every inequality of contact: smoothed max(0, -lambda) / r.
//
//   g(lambda) = (s - lambda) / (2 r) = 2 k / (s + lambda),      s = sqrt(lambda^2 + 4 r k)
//   g solves     r g + lambda = k / g                           g > 0 for k > 0
//   p(lambda)    p' = -g, p'' = g / s                           the convex potential of g
//
// k -> 0 is the projection max(0, -lambda) / r, r -> 0 the log barrier k / lambda (lambda > 0
// only).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint::contact {

/// g, its slope and s = sqrt(lambda^2 + 4 r k) at one lambda. No cancellation in either branch.
struct ScalarLaw {
  double g = 0.0;  ///< impulse
  double s = 0.0;  ///< [m/s]
  double a = 0.0;  ///< -g' = g / s >= 0

  ScalarLaw(double lambda, double r, double k) {
    // The maximum matters only where lambda^2 underflows.
    s = std::max(std::sqrt(lambda * lambda + 4.0 * r * k), std::abs(lambda));
    if (lambda < 0.0) {
      g = (s - lambda) / (2.0 * r);
      a = g / s;
    } else if (s + lambda > 0.0) {
      g = 2.0 * k / (s + lambda);
      a = g / s;
    } else {  // lambda = 0 and r k = 0: the corner, with the mean of the slopes on its sides
      g = k > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
      a = 0.5 / r;
    }
  }
};

/// p(lambda) [J], up to a constant that depends on k only.
inline double scalar_potential(double lambda, const ScalarLaw& law, double r, double k) {
  const double barrier = k > 0.0 ? k * std::log(law.g) : 0.0;
  return barrier - law.g * (0.5 * r * law.g + lambda);
}

}  // namespace counterpoint::contact
