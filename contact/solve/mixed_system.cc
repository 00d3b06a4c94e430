#include "counterpoint/contact/solve/mixed_system.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/laws/coulomb.h"
#include "counterpoint/contact/laws/scalar_law.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

void MixedSystem::Point::reserve(const IslandSystem& system) {
  w.reserve(system.size());
  phi.reserve(system.num_rows());
}

void MixedSystem::Point::add(double step, const Point& d) {
  for (size_t i = 0; i < w.size(); ++i) w[i] += step * d.w[i];
  for (size_t i = 0; i < phi.size(); ++i) phi[i] += step * d.phi[i];
}

void MixedSystem::reserve(const IslandSystem& system) {
  for (auto* v : {&dual_, &momentum_}) v->reserve(system.size());
  for (auto* v : {&y_, &f_, &error_, &rhs_, &dy_, &y_trial_, &phi_trial_, &scales_})
    v->reserve(system.num_rows());
  hessian_.reserve(system.hessian_size());
  laws_.reserve(system.constraints().size());
  lanes_.reserve(static_cast<int>(system.constraints().size()));
}

void MixedSystem::begin(IslandSystem& system, double sigma_share) {
  system_ = &system;
  center = 0.0;
  const size_t n = system.size(), m = system.num_rows();
  for (auto* v : {&dual_, &momentum_}) v->resize(n);
  for (auto* v : {&y_, &f_, &error_, &rhs_, &dy_, &y_trial_, &phi_trial_}) v->resize(m);
  hessian_.resize(system.hessian_size());
  scales_.assign(m, 1.0);
  for (const auto& c : system.constraints()) {
    if (c.law.type != LawType::kFrictionCone) continue;
    for (int r = 1; r < c.law.rows; ++r) scales_[c.row + r] = c.law.friction[r - 1];
  }
  lanes_.begin(system.lanes(), sigma_share);
  laws_.clear();
  for (const int i : system.others()) {
    const auto& c = system.constraints()[i];
    WideLaw law;
    law.law = &c.law;
    law.row = c.row;
    law.rows = c.law.rows;
    law.hessian = c.hessian;
    const bool friction = c.law.type == LawType::kFrictionCone;
    law.rho = friction ? normal_regularizer(c.law) : c.law.regularizer;
    law.sigma = std::max(law.rho, sigma_share * c.inverse_mass);
    // Friction knows nothing of the normal velocity in exact Coulomb laws: it may be widened by
    // itself. z_T = mu y_T moves with mu^2 of what the normal does; half of that way serves best.
    law.sigma_T = c.law.coulomb ? std::max(law.rho, law.sigma * c.law.friction[0]) : law.sigma;
    std::copy_n(scales_.data() + c.row, law.rows, law.scale);
    laws_.push_back(law);
  }
}

void MixedSystem::guess(const std::vector<double>& f, std::vector<double>& phi) {
  const auto& constraints = system_->constraints();
  phi.resize(system_->num_rows());
  const bool all_given = std::none_of(constraints.begin(), constraints.end(),
                                      [&](const auto& c) { return std::isnan(f[c.row]); });
  if (!all_given) {
    system_->constraint_velocity(system_->free_velocity(), y_.data());
    lanes_.impulses(y_.data(), center, phi.data());
    for (WideLaw& law : laws_) {
      double* x = phi.data() + law.row;
      for (int r = 0; r < law.rows; ++r) x[r] = law.scale[r] * y_[law.row + r];
      evaluate(law, x);
    }
  }
  for (const auto& c : constraints) {
    if (std::isnan(f[c.row])) continue;
    for (int r = c.row; r < c.row + c.law.rows; ++r)
      phi[r] = scales_[r] > 0.0 ? f[r] / scales_[r] : 0.0;
  }
}

// x becomes F_sigma(x); A and t of the law are those at x.
void MixedSystem::evaluate(WideLaw& law, double* x) const {
  const int n = law.rows;
  const double k = law.law->smoothing + center;
  switch (law.law->type) {
    case LawType::kEquality:
      for (int i = 0; i < n; ++i) x[i] /= -law.sigma;
      law.A = {1.0 / law.sigma, 1.0 / law.sigma, 1.0 / law.sigma};
      return;
    case LawType::kDryFriction: {
      Law wide;
      wide.type = law.law->type;
      wide.regularizer = law.sigma;
      wide.smoothing = k;
      wide.bound = law.law->bound;
      double f, a;
      contact::evaluate(wide, x, &f, &a);
      x[0] = f;
      law.A = {a};
      return;
    }
    case LawType::kUnilateral: {
      const ScalarLaw scalar(x[0], law.sigma, k);
      x[0] = scalar.g;
      law.A = {scalar.a};
      return;
    }
    case LawType::kFrictionCone:
      return evaluate_cone(law, k, x);
  }
}

void MixedSystem::evaluate_cone(WideLaw& law, double k, double* x) const {
  const int n = law.rows;
  if (law.law->coulomb) {
    const CoulombCone cone(x, n, law.sigma, law.sigma_T, scaled_slip_speed(*law.law), k);
    std::copy(cone.e + 1, cone.e + n, law.t + 1);
    x[0] = cone.n;
    for (int i = 1; i < n; ++i) x[i] *= -cone.b;
    law.A = {cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope, 0.0};
    return;
  }
  double tau = 0.0;
  for (int i = 1; i < n; ++i) tau += x[i] * x[i];
  tau = std::sqrt(tau);
  const ScalarLaw plus(x[0] + tau, law.sigma, k), minus(x[0] - tau, law.sigma, k);
  const double sum = plus.s + minus.s;
  const double across = sum > 0.0 ? (plus.g + minus.g) / sum : 0.5 / law.sigma;
  x[0] = 0.5 * (plus.g + minus.g);
  for (int i = 1; i < n; ++i) {
    law.t[i] = tau > 0.0 ? x[i] / tau : 0.0;
    x[i] *= -across;
  }
  const double mean = 0.5 * (plus.a + minus.a), half = 0.5 * (plus.a - minus.a);
  law.A = {mean, mean, across, half, half};
}

// Errors of all laws, their A and the sum of their squares; returns that sum.
double MixedSystem::evaluate_laws(const double* y, const double* phi_all) {
  law_square_ = lanes_.evaluate(y, phi_all, center);
  for (WideLaw& law : laws_) {
    const double* phi = phi_all + law.row;
    double* e = error_.data() + law.row;
    for (int r = 0; r < law.rows; ++r)
      e[r] = law.scale[r] * y[law.row + r] - (law.wide(r) - law.rho) * phi[r];
    evaluate(law, e);
    for (int r = 0; r < law.rows; ++r) {
      e[r] -= phi[r];
      law_square_ += law.wide(r) * e[r] * e[r];
    }
  }
  return law_square_;
}

// The other residual, and the scale; returns the norm of both.
double MixedSystem::momentum_residual(const Point& point) {
  for (size_t i = 0; i < f_.size(); ++i) f_[i] = scales_[i] * point.phi[i];
  const double* free = system_->free_velocity();
  const double* inverse = system_->inverse_diagonal();
  for (size_t i = 0; i < dual_.size(); ++i) dual_[i] = point.w[i] - free[i];
  system_->multiply_mass(dual_.data(), momentum_.data());
  std::fill(dual_.begin(), dual_.end(), 0.0);
  double scale = system_->add_impulse(f_.data(), dual_.data());
  double square = 0.0, energy = 0.0;
  for (size_t i = 0; i < dual_.size(); ++i) {
    dual_[i] -= momentum_[i];
    square += dual_[i] * dual_[i] * inverse[i];
    scale += momentum_[i] * momentum_[i] * inverse[i];
    energy += (point.w[i] * point.w[i] + free[i] * free[i]) / inverse[i];
  }
  dual_square_ = square;
  scale_ = std::sqrt(scale + kMomentumShare * kMomentumShare * energy);
  return std::sqrt(law_square_ + dual_square_);
}

double MixedSystem::residual(const Point& point) {
  system_->constraint_velocity(point.w.data(), y_.data());
  evaluate_laws(y_.data(), point.phi.data());
  return momentum_residual(point);
}

double MixedSystem::recenter(const Point& point, double other_center) {
  center = other_center;
  return std::sqrt(evaluate_laws(y_.data(), point.phi.data()) + dual_square_);
}

double MixedSystem::trial(const Point& point, const Point& d, double step) {
  step_ = step;
  for (size_t i = 0; i < y_.size(); ++i) {
    y_trial_[i] = y_[i] + step * dy_[i];
    phi_trial_[i] = point.phi[i] + step * d.phi[i];
  }
  const double left = 1.0 - step;
  return std::sqrt(evaluate_laws(y_trial_.data(), phi_trial_.data()) + left * left * dual_square_);
}

double MixedSystem::accept(const Point& d, Point& point) {
  std::swap(point.phi, phi_trial_);
  for (size_t i = 0; i < point.w.size(); ++i) point.w[i] += step_ * d.w[i];
  // Not y + step J d, whose rounding would add up over the steps.
  system_->constraint_velocity(point.w.data(), y_.data());
  return momentum_residual(point);
}

void MixedSystem::WideLaw::apply(const Operator& op, const double* x, double* out) const {
  double along = 0.0;
  for (int i = 1; i < rows; ++i) along += t[i] * x[i];
  out[0] = op.normal * x[0] + op.normal_radial * along;
  const double radial = op.radial_normal * x[0] + (op.radial - op.across) * along;
  for (int i = 1; i < rows; ++i) out[i] = op.across * x[i] + radial * t[i];
}

// inv(1 - (sigma - rho) A).
MixedSystem::Operator MixedSystem::WideLaw::widening() const {
  const double d = sigma - rho, d_T = sigma_T - rho;
  const double nn = 1.0 - d * A.normal, rr = 1.0 - d_T * A.radial;
  const double nr = -d_T * A.normal_radial, rn = -d * A.radial_normal;
  const double determinant = nn * rr - nr * rn;
  return {rr / determinant, nn / determinant, 1.0 / (1.0 - d_T * A.across), -rn / determinant,
          -nr / determinant};
}

bool MixedSystem::factor() {
  lanes_.hessians(hessian_.data());
  for (WideLaw& law : laws_) {
    const int n = law.rows;
    law.B = law.widening();
    double* G = hessian_.data() + law.hessian;
    for (int j = 0; j < n; ++j) {
      double column[kMaxRows] = {}, product[kMaxRows], out[kMaxRows];
      column[j] = law.scale[j];
      law.apply(law.A, column, product);
      law.apply(law.B, product, out);
      for (int i = 0; i < n; ++i) G[i * n + j] = law.scale[i] * out[i];
    }
  }
  return system_->factor(hessian_.data(), system_->unsymmetric());
}

// M dw - J'D dphi = dual,  dphi + A (D J dw - (sigma - rho) dphi) = error.
void MixedSystem::direction(Point& out) {
  lanes_.right_side(rhs_.data());
  for (const WideLaw& law : laws_) {
    double x[kMaxRows];
    law.apply(law.B, error_.data() + law.row, x);
    for (int r = 0; r < law.rows; ++r) rhs_[law.row + r] = law.scale[r] * x[r];
  }
  out.w = dual_;
  system_->add_impulse(rhs_.data(), out.w.data());
  system_->solve(out.w.data());
  system_->multiply_jacobian(out.w.data(), dy_.data());
  out.phi.resize(error_.size());
  lanes_.step(dy_.data(), out.phi.data());
  for (const WideLaw& law : laws_) {
    const int n = law.rows;
    double dz[kMaxRows], x[kMaxRows];
    for (int r = 0; r < n; ++r) dz[r] = law.scale[r] * dy_[law.row + r];
    law.apply(law.A, dz, x);
    for (int r = 0; r < n; ++r) x[r] = error_[law.row + r] - x[r];
    law.apply(law.B, x, out.phi.data() + law.row);
  }
}

}  // namespace counterpoint::contact
