#include "counterpoint/contact/solve/wide_laws.h"

#include <algorithm>

#include "counterpoint/contact/laws/scalar_law.h"

namespace counterpoint::contact {
namespace {

// Returns sigma of friction if that of the normal row is `sigma`. With regularized Coulomb friction
// the normal impulse does not depend on friction, which may therefore have its own sigma. The
// inverse mass along z_T = mu y_T is mu^2 times that of the normal; the factor mu, halfway between,
// works best.
double sigma_of_friction(bool coulomb, double sigma, double mu) {
  return coulomb ? sigma * mu : sigma;
}

template <class Law>
COUNTERPOINT_INTO_EACH void gather_scaled(const Law& law, const double* from,
                                          typename Law::Real* to) {
  law.gather(from, to);
  for (int r = 1; r < law.rows; ++r) to[r] = law.scale[r] * to[r];
}

template <class Law>
COUNTERPOINT_INTO_EACH void find_impulses(std::vector<Law>& laws, const double* y,
                                          double extra_smoothing, double* phi) {
  for (Law& law : laws) {
    typename Law::Real x[Law::kMostRows];
    gather_scaled(law, y, x);
    law.evaluate(extra_smoothing, x);
    for (int r = 0; r < law.rows; ++r) law.scatter(x[r], r, phi);
  }
}

// Adds to `square` the sum of sigma |error|^2, in double or by lanes.
template <class Law>
COUNTERPOINT_INTO_EACH void find_errors(std::vector<Law>& laws, const double* y,
                                        const double* phi_all, double extra_smoothing,
                                        typename Law::Real& square) {
  for (Law& law : laws) {
    typename Law::Real x[Law::kMostRows], phi[Law::kMostRows];
    gather_scaled(law, y, x);
    law.gather(phi_all, phi);
    x[0] -= (law.sigma - law.rho) * phi[0];
    for (int r = 1; r < law.rows; ++r) x[r] -= (law.sigma_T - law.rho_T) * phi[r];
    law.evaluate(extra_smoothing, x);
    for (int r = 0; r < law.rows; ++r) law.error[r] = x[r] - phi[r];
    law.add_square(square);
  }
}

template <class Law>
COUNTERPOINT_INTO_EACH void find_hessians(std::vector<Law>& laws, double* hessian) {
  for (Law& law : laws) {
    ConeMap<typename Law::Real> G;
    law.invert();
    law.product(G);
    law.scatter_hessian(G, hessian);
  }
}

template <class Law>
COUNTERPOINT_INTO_EACH void find_right_side(const std::vector<Law>& laws, double* rhs) {
  for (const Law& law : laws) {
    typename Law::Real phi[Law::kMostRows];
    law.B.apply(law.rows, law.e, law.error, phi);
    law.scatter_impulse(phi, rhs);
  }
}

template <class Law>
COUNTERPOINT_INTO_EACH void find_step(const std::vector<Law>& laws, const double* dy,
                                      double* dphi) {
  for (const Law& law : laws) {
    typename Law::Real dz[Law::kMostRows], x[Law::kMostRows], out[Law::kMostRows];
    gather_scaled(law, dy, dz);
    law.A.apply(law.rows, law.e, dz, x);
    for (int r = 0; r < law.rows; ++r) x[r] = law.error[r] - x[r];
    law.B.apply(law.rows, law.e, x, out);
    for (int r = 0; r < law.rows; ++r) law.scatter(out[r], r, dphi);
  }
}

}  // namespace

WideLaw::WideLaw(const IslandSystem::Constraint& c, double sigma_of_normal)
    : law(&c.law), row(c.row), rows(c.law.rows), hessian(c.hessian) {
  rho = normal_regularizer(c.law);
  rho_T = friction_regularizer(c.law);
  const bool friction = c.law.type == LawType::kFrictionCone;
  for (int r = 0; r < rows; ++r) scale[r] = friction && r > 0 ? c.law.friction[r - 1] : 1.0;
  widen(sigma_of_normal, sigma_of_friction(c.law.coulomb, sigma_of_normal, c.law.friction[0]));
}

void WideLaw::widen(double normal, double friction) {
  sigma = std::max(rho, normal);
  sigma_T = std::max(rho_T, friction);
}

COUNTERPOINT_INTO_EACH void WideLaw::find(double extra_smoothing, double* x, double* direction,
                                          ConeMap<double>& slopes) const {
  const double k = law->smoothing + extra_smoothing;
  switch (law->type) {
    case LawType::kEquality:
    case LawType::kSpring:
      for (int i = 0; i < rows; ++i) x[i] /= -sigma;
      slopes = {1.0 / sigma, 1.0 / sigma, 1.0 / sigma};
      return;
    case LawType::kDryFriction: {
      Law wide = *law;
      wide.regularizer = sigma;
      wide.smoothing = k;
      const double y = x[0];
      slopes = {};
      contact::evaluate(wide, &y, x, &slopes.normal);
      return;
    }
    case LawType::kUnilateral: {
      const ScalarLaw scalar(x[0], sigma, k);
      x[0] = scalar.g;
      slopes = {scalar.a};
      return;
    }
    case LawType::kFrictionCone: {
      const ConeLaw<double> cone{sigma, sigma_T, scaled_slip_speed(*law), k};
      if (law->coulomb) return evaluate_cone<CoulombCone>(cone, rows, x, direction, slopes);
      return evaluate_cone<ConvexCone>(cone, rows, x, direction, slopes);
    }
  }
}

void WideLaw::evaluate(double extra_smoothing, double* x) { find(extra_smoothing, x, e, A); }

void WideLaw::impulse(double extra_smoothing, double* x) const {
  double direction[kMaxRows];
  ConeMap<double> slopes;
  find(extra_smoothing, x, direction, slopes);
}

template <template <class> class Cone>
WideFour<Cone>::WideFour(const ConeFour& c, double sigma_share) : cones(&c) {
  constexpr bool coulomb = std::is_same_v<Cone<double>, CoulombCone<double>>;
  rho = c.rho;
  rho_T = c.rho_T;
  std::copy_n(c.scale, rows, scale);
  for (int i = 0; i < 4; ++i) {
    const double wide = sigma_share * c.inverse_mass[i];
    sigma[i] = std::max(c.rho[i], wide);
    sigma_T[i] = std::max(c.rho_T[i], sigma_of_friction(coulomb, wide, c.scale[1][i]));
  }
}

void WideLaws::reserve(const IslandSystem& system) {
  const size_t count = system.constraints().size();
  coulomb_.reserve((count + 3) / 4);
  convex_.reserve((count + 3) / 4);
  single_.reserve(count);
}

void WideLaws::begin(const IslandSystem& system, double sigma_share) {
  coulomb_.clear();
  convex_.clear();
  single_.clear();
  for (const ConeFour& c : system.lanes().coulomb()) coulomb_.emplace_back(c, sigma_share);
  for (const ConeFour& c : system.lanes().convex()) convex_.emplace_back(c, sigma_share);
  for (const int i : system.single()) {
    const IslandSystem::Constraint& c = system.constraints()[i];
    single_.emplace_back(c, sigma_share * c.inverse_mass);
  }
}

COUNTERPOINT_WIDE void WideLaws::impulses(const double* y, double extra_smoothing, double* phi) {
  find_impulses(coulomb_, y, extra_smoothing, phi);
  find_impulses(convex_, y, extra_smoothing, phi);
  find_impulses(single_, y, extra_smoothing, phi);
}

COUNTERPOINT_WIDE double WideLaws::evaluate(const double* y, const double* phi,
                                            double extra_smoothing) {
  Four coulomb{}, convex{};
  find_errors(coulomb_, y, phi, extra_smoothing, coulomb);
  find_errors(convex_, y, phi, extra_smoothing, convex);
  double square = sum_lanes(coulomb) + sum_lanes(convex);
  find_errors(single_, y, phi, extra_smoothing, square);
  return square;
}

COUNTERPOINT_WIDE void WideLaws::hessians(double* hessian) {
  find_hessians(coulomb_, hessian);
  find_hessians(convex_, hessian);
  find_hessians(single_, hessian);
}

COUNTERPOINT_WIDE void WideLaws::right_side(double* rhs) const {
  find_right_side(coulomb_, rhs);
  find_right_side(convex_, rhs);
  find_right_side(single_, rhs);
}

COUNTERPOINT_WIDE void WideLaws::step(const double* dy, double* dphi) const {
  find_step(coulomb_, dy, dphi);
  find_step(convex_, dy, dphi);
  find_step(single_, dy, dphi);
}

}  // namespace counterpoint::contact
