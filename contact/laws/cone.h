// Convex friction at one velocity: the spectral decomposition shared by impulse, potential, Hessian
// and sensitivities. Internal to the law.
#pragma once

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Convex law at one velocity z_N, t = |z_T|, or at four. Real: double or Four, with the same bits.
template <class Real>
struct ConvexAt {
  ScalarLawOf<Real> plus, minus;  ///< at the eigenvalues z_N +- t
  Real n{};                       ///< normal impulse
  Real b{};                       ///< phi_T = -b z_T
  Real mean{}, difference{};      ///< -dn/dz_N = -dp/dt, and -dn/dt = -dp/dz_N, p: phi along z_T

  COUNTERPOINT_INTO_EACH ConvexAt(const Real& z_N, const Real& t, const Real& rho, const Real& k)
      : plus(z_N + t, rho, k), minus(z_N - t, rho, k) {
    const Real sum = plus.s + minus.s;
    n = 0.5 * (plus.g + minus.g);
    b = sum > 0.0 ? (plus.g + minus.g) / sum : 0.5 / rho;
    mean = 0.5 * (plus.a + minus.a);
    difference = 0.5 * (plus.a - minus.a);
  }
};

/// Convex law with any number of friction rows.
struct Cone : ConvexAt<double> {
  double z[kMaxRows];                ///< scaled velocity; z[0] is the normal
  double e[kMaxRows] = {};           ///< unit vector along z_T; e[0] unused
  double lambda_plus, lambda_minus;  ///< z_N +- t
  double rho;

  Cone(const Law& law, const double* y) : Cone(law, scale(law, y)) {}

 private:
  struct Scaled {
    double z[kMaxRows];
    double t;
  };
  static Scaled scale(const Law& law, const double* y) {
    Scaled out;
    out.z[0] = y[0];
    double square = 0.0;
    for (int i = 1; i < law.rows; ++i) {
      out.z[i] = law.friction[i - 1] * y[i];
      square += out.z[i] * out.z[i];
    }
    out.t = std::sqrt(square);
    return out;
  }

  Cone(const Law& law, const Scaled& in)
      : ConvexAt(in.z[0], in.t, normal_regularizer(law), law.smoothing),
        lambda_plus(in.z[0] + in.t),
        lambda_minus(in.z[0] - in.t),
        rho(normal_regularizer(law)) {
    std::copy(in.z, in.z + law.rows, z);
    const double inverse = in.t > 0.0 ? 1.0 / in.t : 0.0;
    for (int i = 1; i < law.rows; ++i) e[i] = z[i] * inverse;
  }
};

}  // namespace counterpoint::contact
