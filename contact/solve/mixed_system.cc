#include "counterpoint/contact/solve/mixed_system.h"

#include <algorithm>
#include <cmath>

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
  for (auto* v : {&y_, &f_, &rhs_, &dy_, &y_trial_, &phi_trial_, &scales_})
    v->reserve(system.num_rows());
  hessian_.reserve(system.hessian_size());
  laws_.reserve(system);
}

void MixedSystem::begin(IslandSystem& system, double sigma_share) {
  system_ = &system;
  extra_smoothing = 0.0;
  const size_t n = system.size(), m = system.num_rows();
  for (auto* v : {&dual_, &momentum_}) v->resize(n);
  for (auto* v : {&y_, &f_, &rhs_, &dy_, &y_trial_, &phi_trial_}) v->resize(m);
  hessian_.resize(system.hessian_size());
  scales_.assign(m, 1.0);
  for (const auto& c : system.constraints()) {
    if (c.law.type != LawType::kFrictionCone) continue;
    for (int r = 1; r < c.law.rows; ++r) scales_[c.row + r] = c.law.friction[r - 1];
  }
  laws_.begin(system, sigma_share);
}

void MixedSystem::guess(const std::vector<double>& f, std::vector<double>& phi) {
  const auto& constraints = system_->constraints();
  phi.resize(system_->num_rows());
  const bool all_given = std::none_of(constraints.begin(), constraints.end(),
                                      [&](const auto& c) { return std::isnan(f[c.row]); });
  if (!all_given) {
    system_->constraint_velocity(system_->free_velocity(), y_.data());
    laws_.impulses(y_.data(), extra_smoothing, phi.data());
  }
  for (const auto& c : constraints) {
    if (std::isnan(f[c.row])) continue;
    for (int r = 0; r < c.law.rows; ++r) {
      const double scale = scales_[c.row + r];
      double upright = f[c.row + r];
      if (r == 1 || r == 2) upright += c.law.lean[static_cast<size_t>(r - 1)] * f[c.row];
      phi[c.row + r] = scale > 0.0 ? upright / scale : 0.0;
    }
  }
}

// Evaluates the errors of all laws and their A; returns the weighted sum of squares of the errors.
double MixedSystem::evaluate_laws(const double* y, const double* phi) {
  law_square_ = laws_.evaluate(y, phi, extra_smoothing);
  return law_square_;
}

// Evaluates the momentum residual and the scale; returns the norm of both residuals.
double MixedSystem::momentum_residual(const Point& point) {
  for (size_t i = 0; i < f_.size(); ++i) f_[i] = scales_[i] * point.phi[i];
  for (const WideLaw& law : laws_.single()) lean_impulse(*law.law, f_.data() + law.row);
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

MixedSystem::Dissipation MixedSystem::dissipation(const Point& point) const {
  const double* free = system_->free_velocity();
  double square = 0.0, work = 0.0;  // |w - w*|_M^2 = f'J (w - w*), and f'(J w + b)
  for (size_t i = 0; i < momentum_.size(); ++i) square += momentum_[i] * (point.w[i] - free[i]);
  for (size_t i = 0; i < f_.size(); ++i) work += f_[i] * y_[i];
  const double slope = work - square;  // f'(J w* + b)
  if (!(slope < 0.0 && square > 0.0)) return {};
  const double t = std::min(1.0, -slope / square);
  return {t, t * slope + 0.5 * t * t * square};
}

bool MixedSystem::raise_loads(Point& point) const {
  bool raised = false;
  for (const auto& c : system_->constraints()) {
    if (!is_one_sided(c.law.type)) continue;
    const double rho = normal_regularizer(c.law);
    const double k = c.law.smoothing + extra_smoothing, z = y_[c.row];
    double* phi = point.phi.data() + c.row;
    // Raises only a load beyond the law's kink that Newton's step would about double.
    if (!(c.inverse_mass * phi[0] * phi[0] > k) || (z + rho * phi[0]) * phi[0] > 0.5 * k) continue;
    const double factor = ScalarLaw(z, rho, k).g / phi[0];
    if (factor < 2.0) continue;
    for (int r = 0; r < c.law.rows; ++r) phi[r] *= factor;
    raised = true;
  }
  return raised;
}

double MixedSystem::resmooth(const Point& point, double other_smoothing) {
  extra_smoothing = other_smoothing;
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
  // Not y + step J d, whose rounding errors would accumulate over the steps.
  system_->constraint_velocity(point.w.data(), y_.data());
  return momentum_residual(point);
}

bool MixedSystem::factor() {
  laws_.hessians(hessian_.data());
  return system_->factor(hessian_.data(), system_->unsymmetric());
}

// Solves M dw - J'D dphi = dual, dphi + A (D J dw - (sigma - rho) dphi) = error.
void MixedSystem::direction(Point& out) {
  laws_.right_side(rhs_.data());
  out.w = dual_;
  system_->add_impulse(rhs_.data(), out.w.data());
  system_->solve(out.w.data());
  system_->multiply_jacobian(out.w.data(), dy_.data());
  out.phi.resize(rhs_.size());
  laws_.step(dy_.data(), out.phi.data());
}

}  // namespace counterpoint::contact
