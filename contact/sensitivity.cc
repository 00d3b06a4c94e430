#include <cmath>

#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/laws/cone.h"
#include "counterpoint/contact/laws/coulomb.h"
#include "counterpoint/contact/laws/scalar_law.h"

namespace counterpoint::contact {
namespace {

// Derivatives of the scalar law, from r g + lambda = k / g: dg/dk = 1 / s and dg/dr = -g^2 / s.
double by_smoothing(const ScalarLaw& law) { return 1.0 / law.s; }
double by_regularizer(const ScalarLaw& law) { return -law.g * law.g / law.s; }

// Computes df/dmu_j of f = D phi(D y), with -dphi_i/dz_j = b d_ij + (along - b) t_i t_j and
// -dphi_N/dz_j = normal t_j. The inner D contributes dz_j/dmu_j = y_j, the outer D adds phi_j.
void friction_columns(const Law& law, const Rows& y, const double* t, double b, double along,
                      double normal, RowsSquare& out) {
  out.resize(law.rows, law.rows - 1);
  for (int j = 1; j < law.rows; ++j) {
    out(0, j - 1) = -normal * t[j] * y[j];
    for (int i = 1; i < law.rows; ++i) {
      const double slope = (i == j ? b : 0.0) + (along - b) * t[i] * t[j];
      out(i, j - 1) = -law.friction[i - 1] * slope * y[j];
    }
    out(j, j - 1) -= b * law.friction[j - 1] * y[j];
  }
}

// Returns f with these components of phi: `normal`, and `radial` along t, the direction of z_T.
Rows normal_and_radial(const Law& law, const double* t, double normal, double radial) {
  Rows out(law.rows);
  out[0] = normal;
  for (int i = 1; i < law.rows; ++i) out[i] = law.friction[i - 1] * radial * t[i];
  return out;
}

void convex_sensitivity(const Law& law, const Rows& y, Sensitivity& out, Rows& by_rho) {
  const Cone cone(law, y.data());
  const auto spectral = [&](double plus, double minus) {
    return normal_and_radial(law, cone.e, 0.5 * (plus + minus), 0.5 * (plus - minus));
  };
  out.smoothing = spectral(by_smoothing(cone.plus), by_smoothing(cone.minus));
  by_rho = spectral(by_regularizer(cone.plus), by_regularizer(cone.minus));
  friction_columns(law, y, cone.e, cone.b, cone.mean, cone.difference, out.friction);
}

Rows scaled_slip_speed_derivative(const Law& law, const CoulombCone& cone) {
  const double p_by_v = cone.n > 0.0 ? -cone.p / cone.n * cone.p_slope : 0.0;
  return normal_and_radial(law, cone.e, 0.0, -p_by_v);
}

// Implicit differentiation of F(p) = (rho + v / n) p + (k / n) p / (n - p) - t = 0 at fixed n:
// dp/drho = -p dp/dt, dp/dv = -p / n dp/dt and dp/dk = -p / (n u) dp/dt, where dp/dt / u = 1 / s of
// the slack.
void coulomb_sensitivity(const Law& law, const Rows& y, Sensitivity& out, Rows& by_rho) {
  const CoulombCone cone = coulomb_cone(law, y.data());
  const double n_by_k = 1.0 / cone.n_root, n_by_rho = -cone.n * cone.n / cone.n_root;
  // Open contact without load: n = k / z_N to first order in k, and u / n = g(t - v + z_N; v, z_N).
  const double v = scaled_slip_speed(law);
  const double p_by_k = cone.b > 0.0 ? cone.p_by_n * n_by_k - cone.p / (cone.n * cone.u_root)
                                     : (1.0 - ScalarLaw(cone.t - v + y[0], v, y[0]).g) / y[0];
  out.smoothing = normal_and_radial(law, cone.e, n_by_k, -p_by_k);
  by_rho =
      normal_and_radial(law, cone.e, n_by_rho, -(cone.p_by_n * n_by_rho - cone.p * cone.p_slope));
  friction_columns(law, y, cone.e, cone.b, cone.p_slope, 0.0, out.friction);
  const Rows by_v = scaled_slip_speed_derivative(law, cone);
  out.slip_speed = law.friction[0] * by_v;
  out.friction.col(0) += law.slip_speed * by_v;
}

void cone_sensitivity(const Law& law, const Rows& y, Sensitivity& out) {
  Rows by_rho;
  if (law.coulomb) {
    coulomb_sensitivity(law, y, out, by_rho);
  } else {
    convex_sensitivity(law, y, out, by_rho);
  }
  const double mu = std::max(law.friction[0], kMinRegularizingFriction);
  lean_impulse(law, by_rho.data());
  lean_impulse(law, out.smoothing.data());
  out.regularizer = mu * mu * by_rho;
  if (law.friction[0] >= kMinRegularizingFriction)
    out.friction.col(0) += 2.0 * mu * law.regularizer * by_rho;
}

}  // namespace

Rows slip_speed_derivative(const Law& law, const Rows& y) {
  if (law.type != LawType::kFrictionCone || !law.coulomb) return Rows::Zero(law.rows);
  return law.friction[0] * scaled_slip_speed_derivative(law, coulomb_cone(law, y.data()));
}

Sensitivity compute_sensitivity(const Law& law, const Rows& y) {
  Sensitivity out;
  out.velocity = -evaluate(law, y).hessian;
  out.friction.setZero(law.rows, law.rows - 1);
  out.smoothing.setZero(law.rows);
  out.regularizer.setZero(law.rows);
  out.slip_speed.setZero(law.rows);
  out.bound.setZero(law.rows);
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
      out.bound[0] = -2.0 * y[0] / sum + by_sum * r * ((y[0] + r * F) / s2 - (y[0] - r * F) / s1);
      break;
    }
  }
  return out;
}

}  // namespace counterpoint::contact
