// Exact Coulomb friction at one velocity. Internal to the law.
//
// In scaled coordinates z_i = mu_i y_i, f_i = mu_i phi_i, with t = |z_T|, one regularizer rho and
// smoothing k, the normal impulse n does not know of friction, and friction is bounded by n:
//
//   n = g(z_N)                       the scalar law (scalar_law.h)
//   phi_T = -b z_T,   p = b t        solves   rho p + (k / n) p / (n - p) = t
//
// that is, with the slack u = n - p, the scalar law again: u = g(t - rho n + k / n),
// b = n / (rho n + k / u). k -> 0: b = min(1 / rho, n / t), the clamp of -z_T / rho to |phi_T| <= n.
// rho phi + z is a function of phi alone, so the law of rho at z is the law of any sigma at
// z - (sigma - rho) phi (mixed_system.h).
#pragma once

#include <cmath>

#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/scalar_law.h"

namespace counterpoint::contact {

struct CoulombCone {
  double n = 0.0;            ///< normal impulse
  double n_slope = 0.0;      ///< -dn/dz_N
  double n_root = 0.0;       ///< s of the normal's scalar law
  double b = 0.0;            ///< phi_T = -b z_T
  double p_slope = 0.0;      ///< dp/dt at fixed n
  double p_by_n = 0.0;       ///< dp/dn at fixed t
  double p = 0.0, t = 0.0;   ///< |phi_T|, |z_T|
  double u_root = 0.0;       ///< s of the slack's scalar law
  double e[kMaxRows] = {};   ///< direction of z_T; e[0] unused

  /// z: scaled velocity, `rows` numbers; rho_N, rho: regularizers of normal and friction.
  CoulombCone(const double* z, int rows, double rho_N, double rho, double k) {
    const ScalarLaw normal(z[0], rho_N, k);
    n = normal.g;
    n_slope = normal.a;
    n_root = normal.s;
    double square = 0.0;
    for (int i = 1; i < rows; ++i) square += z[i] * z[i];
    t = std::sqrt(square);
    const double inverse = t > 0.0 ? 1.0 / t : 0.0;
    for (int i = 1; i < rows; ++i) e[i] = z[i] * inverse;
    const double bound = n;
    const double push = k > 0.0 ? k / bound : 0.0;
    if (!(bound > 0.0) || !(push < 1e100)) return;  // no load, no friction
    const double lambda = (t - rho * bound) + push;
    const ScalarLaw slack(lambda, rho, k);
    // k / u, by the branch that does not cancel.
    const double m =
        lambda >= 0.0 ? 0.5 * (slack.s + lambda) : 2.0 * rho * k / (slack.s - lambda);
    b = bound / (rho * bound + m);
    p = b * t;
    p_slope = slack.a;
    u_root = slack.s;
    p_by_n = slack.s > 0.0 ? (m / slack.s) * (p / bound) * (1.0 + slack.g / bound)
                           : 0.5;
  }

  /// out = -dphi/dz x.
  void apply_slope(const double* x, int rows, double* out) const {
    double radial = 0.0;
    for (int i = 1; i < rows; ++i) radial += e[i] * x[i];
    const double along = (p_slope - b) * radial - p_by_n * n_slope * x[0];
    for (int i = 1; i < rows; ++i) out[i] = b * x[i] + along * e[i];
    out[0] = n_slope * x[0];
  }
};

}  // namespace counterpoint::contact
