#include "counterpoint/contact/solve/wide_law.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/laws/cone.h"
#include "counterpoint/contact/laws/coulomb.h"
#include "counterpoint/contact/laws/scalar_law.h"

namespace counterpoint::contact {
namespace {

// Replaces x by the impulse of exact friction at the smoothing k [J].
inline CoulombCone take_coulomb(const WideLaw& law, double k, double* x) {
  const CoulombCone cone(x, law.rows, law.sigma, law.sigma_T, scaled_slip_speed(*law.law), k);
  x[0] = cone.n;
  for (int i = 1; i < law.rows; ++i) x[i] *= -cone.b;
  return cone;
}

}  // namespace

double own_regularizer(const Law& law) {
  return law.type == LawType::kFrictionCone ? normal_regularizer(law) : law.regularizer;
}

WideLaw::WideLaw(const IslandSystem::Constraint& c, double sigma_of_normal)
    : law(&c.law), row(c.row), rows(c.law.rows), hessian(c.hessian), rho(own_regularizer(c.law)) {
  const bool friction = c.law.type == LawType::kFrictionCone;
  std::fill_n(scale, rows, 1.0);
  for (int r = 1; friction && r < rows; ++r) scale[r] = c.law.friction[r - 1];
  // With regularized Coulomb friction the normal impulse does not depend on friction, which may
  // therefore have its own sigma. The inverse mass along z_T = mu y_T is mu^2 times that of the
  // normal; the factor mu, halfway between, works best.
  widen(sigma_of_normal,
        c.law.coulomb ? std::max(rho, sigma_of_normal) * c.law.friction[0] : sigma_of_normal);
}

void WideLaw::widen(double normal, double friction) {
  sigma = std::max(rho, normal);
  sigma_T = std::max(rho, friction);
}

// Replaces x by F_sigma(x); A and t of the law become those at x.
void WideLaw::evaluate(double extra_smoothing, double* x) {
  const double k = law->smoothing + extra_smoothing;
  switch (law->type) {
    case LawType::kEquality:
      for (int i = 0; i < rows; ++i) x[i] /= -sigma;
      A = {1.0 / sigma, 1.0 / sigma, 1.0 / sigma};
      return;
    case LawType::kDryFriction: {
      Law wide;
      wide.type = law->type;
      wide.regularizer = sigma;
      wide.smoothing = k;
      wide.bound = law->bound;
      double f, a;
      contact::evaluate(wide, x, &f, &a);
      x[0] = f;
      A = {a};
      return;
    }
    case LawType::kUnilateral: {
      const ScalarLaw scalar(x[0], sigma, k);
      x[0] = scalar.g;
      A = {scalar.a};
      return;
    }
    case LawType::kFrictionCone:
      return evaluate_cone(k, x);
  }
}

// Evaluates the impulse alone, since sweeps visit contacts often and need no derivatives, which
// cost four divisions: the compiler leaves out unused results.
void WideLaw::impulse(double extra_smoothing, double* x) {
  if (law->type != LawType::kFrictionCone || !law->coulomb) return evaluate(extra_smoothing, x);
  take_coulomb(*this, law->smoothing + extra_smoothing, x);
}

void WideLaw::evaluate_cone(double k, double* x) {
  if (law->coulomb) {
    const CoulombCone cone = take_coulomb(*this, k, x);
    std::copy(cone.e + 1, cone.e + rows, t + 1);
    A = {cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope, 0.0};
    return;
  }
  double tau = 0.0;
  for (int i = 1; i < rows; ++i) tau += x[i] * x[i];
  tau = std::sqrt(tau);
  const ConvexAt<double> cone(x[0], tau, sigma, k);
  x[0] = cone.n;
  for (int i = 1; i < rows; ++i) {
    t[i] = tau > 0.0 ? x[i] / tau : 0.0;
    x[i] *= -cone.b;
  }
  A = {cone.mean, cone.mean, cone.b, cone.difference, cone.difference};
}

void WideLaw::apply(const Operator& op, const double* x, double* out) const {
  double along = 0.0;
  for (int i = 1; i < rows; ++i) along += t[i] * x[i];
  out[0] = op.normal * x[0] + op.normal_radial * along;
  const double radial = op.radial_normal * x[0] + (op.radial - op.across) * along;
  for (int i = 1; i < rows; ++i) out[i] = op.across * x[i] + radial * t[i];
}

// Returns inv(1 - (sigma - rho) A).
WideLaw::Operator WideLaw::widening() const {
  const double d = sigma - rho, d_T = sigma_T - rho;
  const double nn = 1.0 - d * A.normal, rr = 1.0 - d_T * A.radial;
  const double nr = -d_T * A.normal_radial, rn = -d * A.radial_normal;
  const double determinant = nn * rr - nr * rn;
  return {rr / determinant, nn / determinant, 1.0 / (1.0 - d_T * A.across), -rn / determinant,
          -nr / determinant};
}

}  // namespace counterpoint::contact
