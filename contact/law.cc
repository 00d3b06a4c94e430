#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/laws/cones.h"
#include "counterpoint/contact/laws/dual.h"
#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

// The numbers of a law. Real: double, or Dual for the derivatives by them.
template <class Real>
struct LawNumbers {
  Real r, k, slip, bound;
  Real friction[kMaxRows - 1];
  double normal;
  bool coulomb;

  ConeLaw<Real> cone() const {
    const Real mu = friction[0] < kMinRegularizingFriction ? kMinRegularizingFriction : friction[0];
    const Real rho_T = mu * mu * r, rho = normal > 0.0 ? Real{} + normal : rho_T;
    return {rho, coulomb ? rho_T : rho, friction[0] * slip, k};
  }
  Real of_first_row() const { return normal > 0.0 ? Real{} + normal : r; }
};

template <class Real = double>
LawNumbers<Real> numbers_of(const Law& law) {
  LawNumbers<Real> out{law.regularizer, law.smoothing, law.slip_speed, law.bound, {},
                       law.normal,      law.coulomb};
  std::copy(law.friction.begin(), law.friction.end(), out.friction);
  return out;
}

// Computes z = D y.
template <class Real>
void scale_velocity(const Law& law, const LawNumbers<Real>& numbers, const double* y, Real* z) {
  z[0] = y[0];
  for (int i = 1; i < law.rows; ++i) z[i] = numbers.friction[i - 1] * y[i];
}

// Computes f = D phi, tilted by the lean. The compiler leaves out the slopes, which are not used
// and need most of the divisions.
template <template <class> class Cone, class Real>
void cone_impulse(const Law& law, const LawNumbers<Real>& numbers, const double* y, Real* f) {
  Real z[kMaxRows];
  scale_velocity(law, numbers, y, z);
  const Cone<Real> cone = cone_at<Cone>(numbers.cone(), law.rows, z);
  f[0] = cone.n;
  for (int i = 1; i < law.rows; ++i) f[i] = -numbers.friction[i - 1] * cone.b * z[i];
  lean_impulse(law, f);
}

// Dry friction f = -2 F y / (s1 + s2), the smoothed clamp of -y / r to [-F, F]: the difference of
// two scalar laws at y -+ r F, written without cancellation.
template <class Real>
struct DryFriction {
  Real bound, lambda1, lambda2;
  double y;
  ScalarLawOf<Real> law1, law2;

  DryFriction(const LawNumbers<Real>& law, double velocity)
      : bound(law.bound),
        lambda1(velocity - law.r * law.bound),
        lambda2(velocity + law.r * law.bound),
        y(velocity),
        law1(lambda1, law.r, law.k),
        law2(lambda2, law.r, law.k) {}

  Real impulse() const {
    const Real sum = law1.s + law2.s;
    return sum > 0.0 ? -2.0 * bound * y / sum : Real{};
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

template <class Real>
void find_impulse(const Law& law, const LawNumbers<Real>& numbers, const double* y, Real* f) {
  switch (law.type) {
    case LawType::kUnilateral:
      f[0] = ScalarLawOf<Real>(y[0], numbers.of_first_row(), numbers.k).g;
      return;
    case LawType::kFrictionCone:
      if (!law.coulomb) return cone_impulse<ConvexCone>(law, numbers, y, f);
      return cone_impulse<CoulombCone>(law, numbers, y, f);
    case LawType::kEquality:
    case LawType::kSpring:
      for (int i = 0; i < law.rows; ++i) f[i] = -y[i] / numbers.r;
      return;
    case LawType::kDryFriction:
      f[0] = DryFriction<Real>(numbers, y[0]).impulse() + law.center;
      return;
  }
}

// Computes f and G of a cone.
void evaluate_friction(const Law& law, const double* y, double* f, double* hessian) {
  const LawNumbers<double> numbers = numbers_of(law);
  double z[kMaxRows], phi[kMaxRows], e[kMaxRows];
  ConeMap<double> A;
  scale_velocity(law, numbers, y, z);
  std::copy_n(z, law.rows, phi);
  if (law.coulomb) {
    evaluate_cone<CoulombCone>(numbers.cone(), law.rows, phi, e, A);
  } else {
    evaluate_cone<ConvexCone>(numbers.cone(), law.rows, phi, e, A);
  }
  f[0] = phi[0];
  for (int i = 1; i < law.rows; ++i) f[i] = -law.friction[i - 1] * A.across * z[i];
  lean_impulse(law, f);
  write_hessian(law, A, e, hessian);
}

// Returns whether the regularizer is the inverse of given gains: a spring with a damper, or a servo
// with a bounded impulse (dry friction without smoothing).
bool has_given_gains(const Law& law) {
  return law.type == LawType::kSpring ||
         (law.type == LawType::kDryFriction && !(law.smoothing > 0.0));
}

}  // namespace

void write_hessian(const Law& law, const ConeMap<double>& A, const double* e, double* hessian) {
  const int n = law.rows;
  const bool cone = law.type == LawType::kFrictionCone;
  const auto scale = [&](int i) { return cone && i > 0 ? law.friction[i - 1] : 1.0; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      double entry = 0.0;
      A.entry(i, j, e, entry);
      hessian[i * n + j] = (scale(i) * scale(j)) * entry;
    }
  }
  for (int i = 0; leans(law) && i < 2; ++i)
    for (int j = 0; j < n; ++j) hessian[(i + 1) * n + j] -= law.lean[i] * hessian[j];
}

bool is_valid(const Law& law) {
  if (law.rows < 1 || law.rows > kMaxRows || !(law.regularizer > 0.0)) return false;
  if (!(law.smoothing >= 0.0) || !(law.normal >= 0.0)) return false;
  switch (law.type) {
    case LawType::kUnilateral:
      return law.rows == 1;
    case LawType::kDryFriction:
      return law.rows == 1 && law.bound >= 0.0;
    case LawType::kEquality:
    case LawType::kSpring:
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
  double sum = (law.regularizer - law.regularizer) + (law.normal - law.normal) +
               (law.smoothing - law.smoothing) + (law.bound - law.bound) +
               (law.center - law.center);
  for (const double mu : law.friction) sum += mu - mu;
  for (const double b : law.bias) sum += b - b;
  for (const double share : law.lean) sum += share - share;
  return sum == 0.0;
}

Law soften(const Law& law, const Softness& softness) {
  Law out = law;
  if (has_given_gains(law)) return out;
  out.regularizer *= softness.factor;
  out.normal *= softness.factor;
  out.coulomb = law.coulomb && !softness.convex;
  if (softness.convex && is_one_sided(law.type)) out.bias[0] = std::max(law.bias[0], 0.0);
  if (softness.convex) out.lean = {};
  return out;
}

double normal_regularizer(const Law& law) {
  const LawNumbers<double> numbers = numbers_of(law);
  return law.type == LawType::kFrictionCone ? numbers.cone().rho : numbers.of_first_row();
}

double friction_regularizer(const Law& law) {
  return law.type == LawType::kFrictionCone ? numbers_of(law).cone().rho_T
                                            : normal_regularizer(law);
}

double scaled_slip_speed(const Law& law) { return law.friction[0] * law.slip_speed; }

double de_saxce_shift(const Law& law, const double* y) {
  double z[kMaxRows], t = 0.0;
  scale_velocity(law, numbers_of(law), y, z);
  friction_length(law.rows, z, t);
  return t;
}

void impulse(const Law& law, const double* y, double* f) {
  find_impulse(law, numbers_of(law), y, f);
}

void evaluate(const Law& law, const double* y, double* f, double* hessian) {
  switch (law.type) {
    case LawType::kUnilateral: {
      const ScalarLaw scalar(y[0], normal_regularizer(law), law.smoothing);
      f[0] = scalar.g;
      hessian[0] = scalar.a;
      return;
    }
    case LawType::kFrictionCone:
      return evaluate_friction(law, y, f, hessian);
    case LawType::kEquality:
    case LawType::kSpring:
      std::fill(hessian, hessian + law.rows * law.rows, 0.0);
      for (int i = 0; i < law.rows; ++i) {
        f[i] = -y[i] / law.regularizer;
        hessian[i * law.rows + i] = 1.0 / law.regularizer;
      }
      return;
    case LawType::kDryFriction: {
      const DryFriction<double> dry(numbers_of(law), y[0]);
      f[0] = dry.impulse() + law.center;
      hessian[0] = dry.hessian(law);
      return;
    }
  }
}

double potential(const Law& law, const double* y) {
  const double r = law.regularizer, k = law.smoothing;
  switch (law.type) {
    case LawType::kUnilateral: {
      const double rho = normal_regularizer(law);
      return scalar_potential(y[0], ScalarLaw(y[0], rho, k), rho, k);
    }
    case LawType::kFrictionCone: {
      if (law.coulomb) return std::numeric_limits<double>::quiet_NaN();
      const double rho = normal_regularizer(law), t = de_saxce_shift(law, y);
      const ConvexCone<double> cone(y[0], t, {rho, rho, 0.0, k});
      return 0.5 * (scalar_potential(y[0] + t, cone.plus, rho, k) +
                    scalar_potential(y[0] - t, cone.minus, rho, k));
    }
    case LawType::kEquality:
    case LawType::kSpring: {
      double square = 0.0;
      for (int i = 0; i < law.rows; ++i) square += y[i] * y[i];
      return square / (2.0 * r);
    }
    case LawType::kDryFriction:
      return DryFriction<double>(numbers_of(law), y[0]).potential(law) - law.center * y[0];
  }
  return 0.0;
}

Slope slope(const Law& law, const double* y, const double* d) {
  Slope out;
  double f[kMaxRows], hessian[kMaxRows * kMaxRows];
  evaluate(law, y, f, hessian);
  for (int i = 0; i < law.rows; ++i) {
    out.first -= f[i] * d[i];
    for (int j = 0; j < law.rows; ++j) out.second += d[i] * hessian[i * law.rows + j] * d[j];
  }
  return out;
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

namespace {

// The parameters are r, k, slip speed, bound and N - 4 friction coefficients. An even N lets the
// compiler take two derivatives at a time.
template <int N>
void find_sensitivity(const Law& law, const Rows& y, Sensitivity& out) {
  using Number = Dual<N>;
  // The derivative by k at k = 0 is one-sided, as it is at a k that is negligible.
  constexpr double kNegligible = 1e-100;
  LawNumbers<Number> numbers = numbers_of<Number>(law);
  numbers.k.value = std::max(law.smoothing, kNegligible);
  numbers.r.by[0] = numbers.k.by[1] = numbers.slip.by[2] = numbers.bound.by[3] = 1.0;
  for (int j = 0; j + 1 < law.rows; ++j) numbers.friction[j].by[4 + j] = 1.0;
  Number f[kMaxRows];
  find_impulse(law, numbers, y.data(), f);
  for (Rows* rows : {&out.regularizer, &out.smoothing, &out.slip_speed, &out.bound})
    rows->resize(law.rows);
  out.friction.resize(law.rows, law.rows - 1);
  for (int i = 0; i < law.rows; ++i) {
    out.regularizer[i] = f[i].by[0];
    out.smoothing[i] = f[i].by[1];
    out.slip_speed[i] = f[i].by[2];
    out.bound[i] = f[i].by[3];
    for (int j = 0; j + 1 < law.rows; ++j) out.friction(i, j) = f[i].by[4 + j];
  }
}

// A law depends on the regularizer R_N of its first row through R_N f + y, where the convex cone
// has R_N / mu^2 for friction. Returns d(R f)/dR_N.
Rows first_row_share(const Law& law, const double* f) {
  Rows out = Rows::Zero(law.rows);
  out[0] = f[0];
  if (law.type != LawType::kFrictionCone || law.coulomb) return out;
  for (int i = 1; i < law.rows; ++i) {
    const double mu = law.friction[static_cast<size_t>(i - 1)];
    if (mu > 0.0) out[i] = f[i] / (mu * mu);
  }
  return out;
}

}  // namespace

Sensitivity compute_sensitivity(const Law& law, const Rows& y) {
  Sensitivity out;
  double f[kMaxRows], hessian[kMaxRows * kMaxRows];
  evaluate(law, y.data(), f, hessian);
  out.velocity = -Eigen::Map<const RowMatrix>(hessian, law.rows, law.rows);
  out.normal = out.velocity * first_row_share(law, f);
  if (law.rows <= 3) {
    find_sensitivity<6>(law, y, out);
  } else {
    find_sensitivity<10>(law, y, out);
  }
  return out;
}

Rows slip_speed_derivative(const Law& law, const Rows& y) {
  LawNumbers<Dual<1>> numbers = numbers_of<Dual<1>>(law);
  numbers.slip.by[0] = 1.0;
  Dual<1> f[kMaxRows];
  find_impulse(law, numbers, y.data(), f);
  Rows out(law.rows);
  for (int i = 0; i < law.rows; ++i) out[i] = f[i].by[0];
  return out;
}

}  // namespace counterpoint::contact
