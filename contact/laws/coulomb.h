// Regularized Coulomb friction at one velocity. Internal to the law.
//
// Scaled coordinates are z_i = mu_i y_i and f_i = mu_i phi_i, with t = |z_T|, one regularizer rho,
// a slip speed v and smoothing k. The normal impulse n does not depend on friction, and it bounds
// friction:
//
//   n = g(z_N)                       the scalar law (scalar_law.h)
//   phi_T = -b z_T,   p = b t        solves   r p + (k / n) p / (n - p) = t,   r = rho + v / n
//
// With the slack u = n - p this is the scalar law again: u = g(t - r n + k / n; r, k) and
// b = n / (r n + k / u). In the limit k -> 0, b = min(1 / r, n / t): -z_T / r clamped to
// |phi_T| <= n, which sticks up to t = rho n + v. Since rho phi + z is a function of phi alone, the
// law with rho at z is the law with any sigma at z - (sigma - rho) phi (mixed_system.h).
#pragma once

#include <cmath>

#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Coulomb law at one velocity, or at four. Real: double or Four, with the same bits.
template <class Real>
struct CoulombAt {
  Real n{};        ///< normal impulse
  Real n_slope{};  ///< -dn/dz_N
  Real n_root{};   ///< s of the normal's scalar law
  Real b{};        ///< phi_T = -b z_T
  Real p_slope{};  ///< dp/dt at fixed n
  Real p_by_n{};   ///< dp/dn at fixed t
  Real p{};        ///< |phi_T|
  Real u_root{};   ///< s of the slack's scalar law

  COUNTERPOINT_INTO_EACH CoulombAt(const Real& z_N, const Real& t, const Real& rho_N,
                                   const Real& rho, const Real& v, const Real& k) {
    const ScalarLawOf<Real> normal(z_N, rho_N, k);
    n = normal.g;
    n_slope = normal.a;
    n_root = normal.s;
    const Real push = k > 0.0 ? k / n : Real{};
    const Real held = rho * n + v;  // r n
    const Real r = n > 0.0 ? rho + v / n : rho;
    const Real lambda = (t - held) + push;
    const ScalarLawOf<Real> slack(lambda, r, k);
    // k / u in the form without cancellation.
    const Real sum = 0.5 * (slack.s + lambda), ratio = 2.0 * r * k / (slack.s - lambda);
    const Real m = lambda >= 0.0 ? sum : ratio;
    const Real half = Real{} + 0.5, none{};
    const auto loaded = (n > 0.0) & (push < 1e100);  // without load there is no friction
    b = loaded ? n / (held + m) : none;
    p = b * t;
    p_slope = loaded ? slack.a : none;
    u_root = loaded ? slack.s : none;
    const Real share = slack.g / n;
    const Real by_n = (m / slack.s) * (p / n) * (1.0 + share) + (v / slack.s) * (p / n) * share;
    p_by_n = loaded ? (slack.s > 0.0 ? by_n : half) : none;
  }
};

/// Coulomb law with any number of friction rows.
struct CoulombCone : CoulombAt<double> {
  double t = 0.0;           ///< |z_T|
  double e[kMaxRows] = {};  ///< unit vector along z_T; e[0] unused

  /// z: scaled velocity, `rows` numbers; rho_N, rho: regularizers of normal and friction [1/kg]; v:
  /// scaled slip speed [m/s]; k: smoothing [J].
  CoulombCone(const double* z, int rows, double rho_N, double rho, double v, double k)
      : CoulombCone(z, rows, length(z, rows), rho_N, rho, v, k) {}

  /// Computes out = -dphi/dz x.
  void apply_slope(const double* x, int rows, double* out) const {
    double radial = 0.0;
    for (int i = 1; i < rows; ++i) radial += e[i] * x[i];
    const double along = (p_slope - b) * radial - p_by_n * n_slope * x[0];
    for (int i = 1; i < rows; ++i) out[i] = b * x[i] + along * e[i];
    out[0] = n_slope * x[0];
  }

 private:
  CoulombCone(const double* z, int rows, double length_T, double rho_N, double rho, double v,
              double k)
      : CoulombAt(z[0], length_T, rho_N, rho, v, k), t(length_T) {
    const double inverse = t > 0.0 ? 1.0 / t : 0.0;
    for (int i = 1; i < rows; ++i) e[i] = z[i] * inverse;
  }
  static double length(const double* z, int rows) {
    double square = 0.0;
    for (int i = 1; i < rows; ++i) square += z[i] * z[i];
    return std::sqrt(square);
  }
};

/// Evaluates regularized Coulomb friction at the law's own regularizer; y: law.rows numbers [m/s].
inline CoulombCone coulomb_cone(const Law& law, const double* y) {
  double z[kMaxRows] = {y[0]};
  for (int i = 1; i < law.rows; ++i) z[i] = law.friction[i - 1] * y[i];
  const double rho = normal_regularizer(law);
  return {z, law.rows, rho, rho, scaled_slip_speed(law), law.smoothing};
}

}  // namespace counterpoint::contact
