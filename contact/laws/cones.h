// The two friction cones at one velocity or at four, written once for every kind of number.
// Internal to the laws.
//
// Scaled coordinates are z_i = mu_i y_i and f_i = mu_i phi_i, with t = |z_T|; g, s and a are those
// of the scalar law (scalar_law.h).
//
// The convex cone applies the scalar law to the eigenvalues z_N +- t; problem.h has the formulas.
//
// Regularized Coulomb friction has one regularizer rho, a slip speed v and smoothing k. The normal
// impulse n does not depend on friction, and it bounds friction:
//
//   n = g(z_N)
//   phi_T = -b z_T,   p = b t        solves   r p + (k / n) p / (n - p) = t,   r = rho + v / n
//
// With the slack u = n - p this is the scalar law again: u = g(t - r n + k / n; r, k) and
// b = n / (r n + k / u). In the limit k -> 0, b = min(1 / r, n / t): -z_T / r clamped to
// |phi_T| <= n, which sticks up to t = rho n + v. Since rho phi + z is a function of phi alone, the
// law with rho at z is the law with any sigma at z - (sigma - rho) phi (mixed_system.h).
#pragma once

#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Numbers of a cone in scaled coordinates. The convex cone needs rho and k alone.
template <class Real>
struct ConeLaw {
  Real rho{}, rho_T{};  ///< regularizers of normal and friction [1/kg]
  Real slip{};          ///< v [m/s]
  Real k{};             ///< smoothing [J]
};

/// Linear map of scaled rows: a matrix in the directions (normal, e), where e is the unit vector
/// along the friction rows of z, and a multiple of the identity across them. e[0] is unused.
template <class Real>
struct ConeMap {
  Real normal{}, radial{}, across{};
  Real radial_normal{};  ///< from normal to radial
  Real normal_radial{};  ///< from radial to normal; zero for Coulomb friction

  /// Computes out = (this map) x, both `rows` long.
  COUNTERPOINT_INTO_EACH void apply(int rows, const Real* e, const Real* x, Real* out) const {
    Real along{};
    for (int i = 1; i < rows; ++i) along += e[i] * x[i];
    const Real more = radial_normal * x[0] + (radial - across) * along;
    out[0] = normal * x[0] + normal_radial * along;
    for (int i = 1; i < rows; ++i) out[i] = across * x[i] + more * e[i];
  }
  /// Computes entry (i, j) of the matrix of this map.
  COUNTERPOINT_INTO_EACH void entry(int i, int j, const Real* e, Real& out) const {
    if (i == 0) {
      out = j == 0 ? normal : normal_radial * e[j];
    } else if (j == 0) {
      out = radial_normal * e[i];
    } else {
      out = (radial - across) * (e[i] * e[j]);
      if (i == j) out += across;
    }
  }
};

/// Convex cone at z_N and t = |z_T|.
template <class Real>
struct ConvexCone {
  ScalarLawOf<Real> plus, minus;  ///< at the eigenvalues z_N +- t
  Real n{};                       ///< normal impulse
  Real b{};                       ///< phi_T = -b z_T

  COUNTERPOINT_INTO_EACH ConvexCone(const Real& z_N, const Real& t, const ConeLaw<Real>& law)
      : plus(z_N + t, law.rho, law.k), minus(z_N - t, law.rho, law.k) {
    const Real sum = plus.s + minus.s;
    n = 0.5 * (plus.g + minus.g);
    b = sum > 0.0 ? (plus.g + minus.g) / sum : 0.5 / law.rho;
  }
  /// Computes -dphi/dz.
  COUNTERPOINT_INTO_EACH void slopes(ConeMap<Real>& out) const {
    const Real mean = 0.5 * (plus.a + minus.a), difference = 0.5 * (plus.a - minus.a);
    out = {mean, mean, b, difference, difference};
  }
};

/// Coulomb friction at z_N and t = |z_T|.
template <class Real>
struct CoulombCone {
  ScalarLawOf<Real> normal, slack;
  Real n{};  ///< normal impulse
  Real b{};  ///< phi_T = -b z_T
  Real p{};  ///< |phi_T|

  COUNTERPOINT_INTO_EACH CoulombCone(const Real& z_N, const Real& t, const ConeLaw<Real>& law)
      : normal(z_N, law.rho, law.k), n(normal.g), slip_(law.slip) {
    const Real push = n > 0.0 ? law.k / n : Real{};
    const Real held = law.rho_T * n + law.slip;  // r n
    const Real r = n > 0.0 ? law.rho_T + law.slip / n : law.rho_T;
    const Real lambda = (t - held) + push;
    slack = ScalarLawOf<Real>(lambda, r, law.k);  // cppcheck-suppress useInitializationList
    // k / u in the form without cancellation.
    const Real sum = 0.5 * (slack.s + lambda), ratio = 2.0 * r * law.k / (slack.s - lambda);
    slack_push_ = lambda >= 0.0 ? sum : ratio;  // cppcheck-suppress useInitializationList
    loaded_ = (n > 0.0) & (push < 1e100);       // without load there is no friction
    b = loaded_ ? n / (held + slack_push_) : Real{};
    p = b * t;
  }
  /// Computes -dphi/dz.
  COUNTERPOINT_INTO_EACH void slopes(ConeMap<Real>& out) const {
    const Real half = Real{} + 0.5, none{}, share = slack.g / n;
    const Real by_n =
        (slack_push_ / slack.s) * (p / n) * (1.0 + share) + (slip_ / slack.s) * (p / n) * share;
    const Real p_by_n = loaded_ ? (slack.s > 0.0 ? by_n : half) : none;
    out = {normal.a, loaded_ ? slack.a : none, b, -p_by_n * normal.a, none};
  }

 private:
  Real slip_{}, slack_push_{};  // v and k / u
  decltype(Real{} > 0.0) loaded_{};
};

/// Computes t = |z_T| of `rows` numbers z.
template <class Real>
COUNTERPOINT_INTO_EACH void friction_length(int rows, const Real* z, Real& t) {
  Real square{};
  for (int i = 1; i < rows; ++i) square += z[i] * z[i];
  square_root(square, t);
}

/// Returns the cone at z.
template <template <class> class Cone, class Real>
COUNTERPOINT_INTO_EACH Cone<Real> cone_at(const ConeLaw<Real>& law, int rows, const Real* z) {
  Real t;
  friction_length(rows, z, t);
  return Cone<Real>(z[0], t, law);
}

/// Replaces z by phi(z). Computes the unit vector e along z_T (zero at rest) and A = -dphi/dz.
template <template <class> class Cone, class Real>
COUNTERPOINT_INTO_EACH void evaluate_cone(const ConeLaw<Real>& law, int rows, Real* z, Real* e,
                                          ConeMap<Real>& A) {
  Real t;
  friction_length(rows, z, t);
  const Cone<Real> cone(z[0], t, law);
  cone.slopes(A);
  const Real inverse = t > 0.0 ? 1.0 / t : Real{};
  z[0] = cone.n;
  for (int i = 1; i < rows; ++i) {
    e[i] = z[i] * inverse;
    z[i] = -cone.b * z[i];
  }
}

/// Writes G = D A D of one law, tilted by its lean: law.rows squared numbers, row-major.
void write_hessian(const Law& law, const ConeMap<double>& A, const double* e, double* hessian);

}  // namespace counterpoint::contact
