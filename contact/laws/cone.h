// A convex friction cone at one velocity: the spectral decomposition that impulse, potential,
// Hessian and sensitivities share. Internal to the law.
#pragma once

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

struct Cone {
  int friction_rows;
  double z[kMaxRows];  // scaled velocity; z[0] is the normal
  double tau;          // |z_T|
  double lambda_plus, lambda_minus;
  double rho;
  ScalarLaw plus, minus;

  Cone(const Law& law, const double* y) : Cone(law, y, scale(law, y)) {}

  double normal() const { return 0.5 * (plus.g + minus.g); }
  double transverse() const {
    const double sum = plus.s + minus.s;
    return sum > 0.0 ? (plus.g + minus.g) / sum : 0.5 / rho;
  }

 private:
  struct Scaled {
    double z[kMaxRows];
    double tau, rho, lambda_plus, lambda_minus;
  };

  static Scaled scale(const Law& law, const double* y) {
    Scaled out;
    out.rho = normal_regularizer(law);
    out.z[0] = y[0];
    double square = 0.0;
    for (int i = 1; i < law.rows; ++i) {
      out.z[i] = law.friction[i - 1] * y[i];
      square += out.z[i] * out.z[i];
    }
    out.tau = std::sqrt(square);
    out.lambda_plus = y[0] + out.tau;
    out.lambda_minus = y[0] - out.tau;
    return out;
  }

  Cone(const Law& law, const double*, const Scaled& in)
      : friction_rows(law.rows - 1),
        tau(in.tau),
        lambda_plus(in.lambda_plus),
        lambda_minus(in.lambda_minus),
        rho(in.rho),
        plus(in.lambda_plus, in.rho, law.smoothing),
        minus(in.lambda_minus, in.rho, law.smoothing) {
    std::copy(in.z, in.z + law.rows, z);
  }
};

}  // namespace counterpoint::contact
