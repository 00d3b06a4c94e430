#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/laws/cone.h"
#include "counterpoint/contact/laws/coulomb.h"
#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

// Computes f = D phi with phi_N = n and phi_T = -b z_T.
void friction_impulse(const Law& law, double n, double b, const double* y, double* f) {
  f[0] = n;
  for (int i = 1; i < law.rows; ++i) {
    const double mu = law.friction[i - 1];
    f[i] = -mu * b * (mu * y[i]);
  }
}

// Slopes of -phi in the directions (normal, along z_T), and across z_T.
struct FrictionSlopes {
  double normal, radial, across, radial_normal, normal_radial;
};

// Computes G = D Gz D, D = diag(1, mu_1, mu_2, ...), where Gz = -dphi/dz has the given slopes; e:
// unit vector along z_T.
void friction_hessian(const Law& law, const FrictionSlopes& slope, const double* e,
                      double* hessian) {
  const int n = law.rows;
  hessian[0] = slope.normal;
  for (int i = 1; i < n; ++i) {
    const double mu = law.friction[i - 1];
    hessian[i] = mu * (slope.normal_radial * e[i]);
    hessian[i * n] = mu * (slope.radial_normal * e[i]);
    for (int j = 1; j < n; ++j) {
      double g = (slope.radial - slope.across) * (e[i] * e[j]);
      if (i == j) g += slope.across;
      hessian[i * n + j] = (mu * law.friction[j - 1]) * g;
    }
  }
}

void lean_hessian(const Law& law, double* hessian) {
  const int n = law.rows;
  for (int i = 0; leans(law) && i < 2; ++i)
    for (int j = 0; j < n; ++j) hessian[(i + 1) * n + j] -= law.lean[i] * hessian[j];
}

Slope cone_slope(const Law& law, const Cone& cone, const double* d) {
  double dot = 0.0, square = 0.0, radial = 0.0;  // z_T . dz_T, |dz_T|^2, and dz_T along z_T
  for (int i = 1; i < law.rows; ++i) {
    const double dz = law.friction[i - 1] * d[i];
    dot += cone.z[i] * dz;
    square += dz * dz;
    radial += cone.e[i] * dz;
  }
  return {cone.b * dot - cone.n * d[0], cone.mean * (d[0] * d[0] + radial * radial) +
                                            2.0 * cone.difference * radial * d[0] +
                                            cone.b * (square - radial * radial)};
}

/// Computes the impulse alone: the compiler leaves out the unused slopes, which need most of the
/// divisions.
void coulomb_impulse(const Law& law, const double* y, double* f) {
  const double rho = normal_regularizer(law);
  const CoulombAt<double> at(y[0], de_saxce_shift(law, y), rho, rho, scaled_slip_speed(law),
                             law.smoothing);
  friction_impulse(law, at.n, at.b, y, f);
  lean_impulse(law, f);
}

// Dry friction f = -2 F y / (s1 + s2), the smoothed clamp of -y / r to [-F, F]: the difference of
// two scalar laws at y -+ r F, written without cancellation.
struct DryFriction {
  double bound, y, lambda1, lambda2;
  ScalarLaw law1, law2;

  DryFriction(const Law& law, double velocity)
      : bound(law.bound),
        y(velocity),
        lambda1(velocity - law.regularizer * law.bound),
        lambda2(velocity + law.regularizer * law.bound),
        law1(lambda1, law.regularizer, law.smoothing),
        law2(lambda2, law.regularizer, law.smoothing) {}

  double impulse() const {
    const double sum = law1.s + law2.s;
    return sum > 0.0 ? -2.0 * bound * y / sum : 0.0;
  }
  double hessian(const Law& law) const {
    if (bound <= 0.0) return 0.0;
    const double s1 = law1.s, s2 = law2.s;
    if (lambda1 * lambda2 > 0.0) {
      const double c = 4.0 * law.regularizer * law.smoothing;
      const double denominator = s1 * s2 * (lambda2 * s1 + lambda1 * s2);
      return c * 2.0 * y * bound / denominator;
    }
    return law1.a - law2.a;  // one of them is about 1 / r, the other about 0
  }
  double potential(const Law& law) const {
    // The difference of the two scalar laws is f + F, so the potential is p1 - p2 + F y.
    const double r = law.regularizer, k = law.smoothing;
    return scalar_potential(lambda1, law1, r, k) - scalar_potential(lambda2, law2, r, k) +
           bound * y;
  }
};

// Returns whether the law is a motor, that is dry friction without smoothing: a servo with a
// bounded impulse, whose regularizer is the inverse of its gains.
bool is_motor(const Law& law) {
  return law.type == LawType::kDryFriction && !(law.smoothing > 0.0);
}

}  // namespace

bool is_valid(const Law& law) {
  if (law.rows < 1 || law.rows > kMaxRows || !(law.regularizer > 0.0)) return false;
  if (!(law.smoothing >= 0.0)) return false;
  switch (law.type) {
    case LawType::kUnilateral:
      return law.rows == 1;
    case LawType::kDryFriction:
      return law.rows == 1 && law.bound >= 0.0;
    case LawType::kEquality:
      return true;
    case LawType::kFrictionCone:
      if (leans(law) && (!law.coulomb || law.rows < 3)) return false;
      return law.rows >= 2 && std::all_of(law.friction.begin(), law.friction.begin() + law.rows - 1,
                                          [](double mu) { return mu >= 0.0; });
  }
  return false;
}

bool is_finite(const Law& law) {
  // x - x is zero for finite x, else NaN; the sum needs no branches.
  double sum = (law.regularizer - law.regularizer) + (law.smoothing - law.smoothing) +
               (law.bound - law.bound);
  for (const double mu : law.friction) sum += mu - mu;
  for (const double b : law.bias) sum += b - b;
  for (const double share : law.lean) sum += share - share;
  return sum == 0.0;
}

Law soften(const Law& law, const Softness& softness) {
  Law out = law;
  if (is_motor(law)) return out;
  out.regularizer *= softness.factor;
  out.coulomb = law.coulomb && !softness.convex;
  if (softness.convex && is_one_sided(law.type)) out.bias[0] = std::max(law.bias[0], 0.0);
  if (softness.convex) out.lean = {};
  return out;
}

double normal_regularizer(const Law& law) {
  const double mu = std::max(law.friction[0], kMinRegularizingFriction);
  return mu * mu * law.regularizer;
}

double scaled_slip_speed(const Law& law) { return law.friction[0] * law.slip_speed; }

double de_saxce_shift(const Law& law, const double* y) {
  double square = 0.0;
  for (int i = 1; i < law.rows; ++i) {
    const double z = law.friction[i - 1] * y[i];
    square += z * z;
  }
  return std::sqrt(square);
}

void impulse(const Law& law, const double* y, double* f) {
  switch (law.type) {
    case LawType::kUnilateral:
      f[0] = ScalarLaw(y[0], law.regularizer, law.smoothing).g;
      return;
    case LawType::kFrictionCone: {
      if (law.coulomb) return coulomb_impulse(law, y, f);
      const Cone cone(law, y);
      return friction_impulse(law, cone.n, cone.b, y, f);
    }
    case LawType::kEquality:
      for (int i = 0; i < law.rows; ++i) f[i] = -y[i] / law.regularizer;
      return;
    case LawType::kDryFriction:
      f[0] = DryFriction(law, y[0]).impulse();
      return;
  }
}

void evaluate(const Law& law, const double* y, double* f, double* hessian) {
  switch (law.type) {
    case LawType::kUnilateral: {
      const ScalarLaw scalar(y[0], law.regularizer, law.smoothing);
      f[0] = scalar.g;
      hessian[0] = scalar.a;
      return;
    }
    case LawType::kFrictionCone: {
      if (law.coulomb) {
        const CoulombCone cone = coulomb_cone(law, y);
        friction_impulse(law, cone.n, cone.b, y, f);
        friction_hessian(law,
                         {cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope, 0.0},
                         cone.e, hessian);
        lean_impulse(law, f);
        return lean_hessian(law, hessian);
      }
      const Cone cone(law, y);
      friction_impulse(law, cone.n, cone.b, y, f);
      return friction_hessian(law, {cone.mean, cone.mean, cone.b, cone.difference, cone.difference},
                              cone.e, hessian);
    }
    case LawType::kEquality:
      std::fill(hessian, hessian + law.rows * law.rows, 0.0);
      for (int i = 0; i < law.rows; ++i) {
        f[i] = -y[i] / law.regularizer;
        hessian[i * law.rows + i] = 1.0 / law.regularizer;
      }
      return;
    case LawType::kDryFriction: {
      const DryFriction dry(law, y[0]);
      f[0] = dry.impulse();
      hessian[0] = dry.hessian(law);
      return;
    }
  }
}

double potential(const Law& law, const double* y) {
  const double r = law.regularizer, k = law.smoothing;
  switch (law.type) {
    case LawType::kUnilateral:
      return scalar_potential(y[0], ScalarLaw(y[0], r, k), r, k);
    case LawType::kFrictionCone: {
      if (law.coulomb) return std::numeric_limits<double>::quiet_NaN();
      const Cone cone(law, y);
      return 0.5 * (scalar_potential(cone.lambda_plus, cone.plus, cone.rho, k) +
                    scalar_potential(cone.lambda_minus, cone.minus, cone.rho, k));
    }
    case LawType::kEquality: {
      double square = 0.0;
      for (int i = 0; i < law.rows; ++i) square += y[i] * y[i];
      return square / (2.0 * r);
    }
    case LawType::kDryFriction:
      return DryFriction(law, y[0]).potential(law);
  }
  return 0.0;
}

Slope slope(const Law& law, const double* y, const double* d) {
  Slope out;
  if (law.type == LawType::kFrictionCone && law.coulomb) {
    double f[kMaxRows], hessian[kMaxRows * kMaxRows];
    evaluate(law, y, f, hessian);
    for (int i = 0; i < law.rows; ++i) {
      out.first -= f[i] * d[i];
      for (int j = 0; j < law.rows; ++j) out.second += d[i] * hessian[i * law.rows + j] * d[j];
    }
    return out;
  }
  if (law.type == LawType::kFrictionCone) return cone_slope(law, Cone(law, y), d);
  if (law.type == LawType::kEquality) {
    for (int i = 0; i < law.rows; ++i) {
      out.first += y[i] * d[i] / law.regularizer;
      out.second += d[i] * d[i] / law.regularizer;
    }
    return out;
  }
  double f = 0.0, hessian = 0.0;
  evaluate(law, y, &f, &hessian);
  return {-f * d[0], hessian * d[0] * d[0]};
}

Rows impulse(const Law& law, const Rows& y) {
  Rows f(law.rows);
  impulse(law, y.data(), f.data());
  return f;
}

Evaluation evaluate(const Law& law, const Rows& y) {
  Evaluation out;
  out.impulse.resize(law.rows);
  double hessian[kMaxRows * kMaxRows];
  evaluate(law, y.data(), out.impulse.data(), hessian);
  out.hessian = Eigen::Map<const RowMatrix>(hessian, law.rows, law.rows);
  out.potential = potential(law, y.data());
  return out;
}

}  // namespace counterpoint::contact
