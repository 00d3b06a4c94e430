#include "counterpoint/contact/sensitivity.h"

#include <cmath>

#include "counterpoint/contact/cone.h"
#include "counterpoint/contact/scalar_law.h"

namespace counterpoint::contact {
namespace {

// Of the scalar law: dg/dk = 1 / s and dg/dr = -g^2 / s, from r g + lambda = k / g.
double by_smoothing(const ScalarLaw& law) { return 1.0 / law.s; }
double by_regularizer(const ScalarLaw& law) { return -law.g * law.g / law.s; }

// Derivative of f where that of the eigenvalues' g is (plus, minus) and that of the shifted normal
// velocity is `shift`.
Rows spectral(const Law& law, const Cone& cone, double plus, double minus, double shift) {
  Rows out(law.rows);
  plus -= cone.plus.a * shift;
  minus -= cone.minus.a * shift;
  out[0] = 0.5 * (plus + minus);
  for (int i = 1; i < law.rows; ++i) {
    const double t = cone.tau > 0.0 ? cone.z[i] / cone.tau : 0.0;
    out[i] = 0.5 * law.friction[i - 1] * (plus - minus) * t;
  }
  return out;
}

void cone_sensitivity(const Law& law, const Rows& y, Sensitivity& out) {
  const Cone cone(law, y.data());
  const double rho = cone.rho, k = law.smoothing;
  const double mu = std::max(law.friction[0], kMinRegularizingFriction);
  // d shift / d (rho k), the shift being sqrt(tau^2 + rho k) - sqrt(rho k).
  double shift = 0.0;
  if (law.coulomb && cone.tau > 0.0 && rho * k > 0.0) {
    const double eta = std::sqrt(rho * k), root = std::hypot(cone.tau, eta);
    shift = 0.5 / root - 0.5 / eta;
  }
  out.smoothing =
      spectral(law, cone, by_smoothing(cone.plus), by_smoothing(cone.minus), rho * shift);
  const Rows by_rho =
      spectral(law, cone, by_regularizer(cone.plus), by_regularizer(cone.minus), k * shift);
  out.regularizer = mu * mu * by_rho;

  const double mean = 0.5 * (cone.plus.a + cone.minus.a);
  const double difference = 0.5 * (cone.plus.a - cone.minus.a);
  const double b = cone.transverse();
  double t[kMaxRows] = {};
  for (int i = 1; i < law.rows; ++i) t[i] = cone.tau > 0.0 ? cone.z[i] / cone.tau : 0.0;
  out.friction.resize(law.rows, law.rows - 1);
  for (int j = 1; j < law.rows; ++j) {
    // f = D phi(D y): the outer D, then the inner one with y_j dz_j / dmu_j.
    const double shift_j = cone.shift_slope * cone.z[j];
    out.friction(0, j - 1) = -(difference * t[j] + mean * shift_j) * y[j];
    for (int i = 1; i < law.rows; ++i) {
      const double identity = i == j ? b : 0.0;
      const double hessian = identity + (mean - b) * t[i] * t[j] + difference * t[i] * shift_j;
      out.friction(i, j - 1) = -law.friction[i - 1] * hessian * y[j];
    }
    out.friction(j, j - 1) -= b * cone.z[j];
  }
  if (law.friction[0] >= kMinRegularizingFriction) {
    out.friction.col(0) += 2.0 * mu * law.regularizer * by_rho;
  }
}

}  // namespace

Sensitivity compute_sensitivity(const Law& law, const Rows& y) {
  Sensitivity out;
  out.velocity = -evaluate(law, y).hessian;
  out.friction.setZero(law.rows, law.rows - 1);
  out.smoothing.setZero(law.rows);
  out.regularizer.setZero(law.rows);
  const double r = law.regularizer, k = law.smoothing;
  switch (law.type) {
    case LawType::kFrictionCone:
      cone_sensitivity(law, y, out);
      break;
    case LawType::kUnilateral: {
      const ScalarLaw scalar(y[0], r, k);
      out.smoothing[0] = by_smoothing(scalar);
      out.regularizer[0] = by_regularizer(scalar);
      break;
    }
    case LawType::kEquality:
      out.regularizer = y / (r * r);
      break;
    case LawType::kDryFriction: {
      // f = -2 F y / (s1 + s2), s = sqrt((y -+ r F)^2 + 4 r k).
      const double F = law.bound;
      const double s1 = ScalarLaw(y[0] - r * F, r, k).s, s2 = ScalarLaw(y[0] + r * F, r, k).s;
      const double sum = s1 + s2, by_sum = 2.0 * F * y[0] / (sum * sum);
      out.smoothing[0] = by_sum * 2.0 * r * (1.0 / s1 + 1.0 / s2);
      const double ds1 = (-F * (y[0] - r * F) + 2.0 * k) / s1;
      const double ds2 = (F * (y[0] + r * F) + 2.0 * k) / s2;
      out.regularizer[0] = by_sum * (ds1 + ds2);
      break;
    }
  }
  return out;
}

}  // namespace counterpoint::contact
