#include "counterpoint/contact/mixed_system.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/law.h"
#include "counterpoint/contact/scalar_law.h"

namespace counterpoint::contact {
namespace {

/// The same number in [0, 1) for the same two, without pattern: multiples of the golden ratio and
/// of the root of two.
double fraction(size_t index, int detour) {
  const double x =
      0.6180339887498949 * static_cast<double>(index + 1) + 0.4142135623730951 * detour;
  return x - std::floor(x);
}

}  // namespace

void MixedSystem::Point::reserve(const IslandSystem& system) {
  w.reserve(system.size());
  phi.reserve(system.num_rows());
}

void MixedSystem::Point::add(double step, const Point& d) {
  for (size_t i = 0; i < w.size(); ++i) w[i] += step * d.w[i];
  for (size_t i = 0; i < phi.size(); ++i) phi[i] += step * d.phi[i];
}

void MixedSystem::reserve(const IslandSystem& system) {
  for (auto* v : {&dual_, &dual_before_, &momentum_}) v->reserve(system.size());
  for (auto* v : {&y_, &f_, &error_, &error_before_, &rhs_, &dy_}) v->reserve(system.num_rows());
  hessian_.reserve(system.hessian_size());
  cones_.reserve(system.constraints().size());
}

void MixedSystem::begin(IslandSystem& system, double sigma_share, int detour) {
  system_ = &system;
  center = 0.0;
  share = 1.0;
  const size_t n = system.size(), m = system.num_rows();
  for (auto* v : {&dual_, &dual_before_, &momentum_}) v->resize(n);
  for (auto* v : {&y_, &f_, &error_, &error_before_, &rhs_, &dy_}) v->assign(m, 0.0);
  hessian_.resize(system.hessian_size());
  cones_.clear();
  for (const auto& c : system.constraints()) {
    Cone cone;
    cone.type = c.law.type;
    cone.coulomb = c.law.coulomb;
    cone.row = c.row;
    cone.rows = c.law.rows;
    cone.hessian = c.hessian;
    cone.k = c.law.smoothing;
    cone.bound = c.law.bound;
    const bool friction = c.law.type == LawType::kFrictionCone;
    cone.rho = friction ? normal_regularizer(c.law) : c.law.regularizer;
    if (detour > 0) cone.weight = std::pow(4.0, 2.0 * fraction(cones_.size(), detour) - 1.0);
    cone.sigma = std::max(cone.rho, sigma_share * c.inverse_mass);
    cone.scale[0] = 1.0;
    for (int r = 1; r < cone.rows; ++r) cone.scale[r] = friction ? c.law.friction[r - 1] : 1.0;
    cones_.push_back(cone);
  }
}

void MixedSystem::guess(std::vector<double>& phi) {
  phi.assign(system_->num_rows(), 0.0);
  system_->constraint_velocity(system_->free_velocity(), y_.data());
  for (Cone& cone : cones_) {
    double* x = phi.data() + cone.row;
    scaled_velocity(cone, y_.data() + cone.row, x);
    evaluate(cone, x);
  }
}

void MixedSystem::scale_impulses(const std::vector<double>& f, std::vector<double>& phi) const {
  phi.resize(f.size());
  for (const Cone& cone : cones_) {
    for (int r = 0; r < cone.rows; ++r)
      phi[cone.row + r] = cone.scale[r] > 0.0 ? f[cone.row + r] / cone.scale[r] : 0.0;
  }
}

double MixedSystem::impulse_square(const std::vector<double>& phi) const {
  double sum = 0.0;
  for (const Cone& cone : cones_)
    sum += cone.sigma * dot(phi.data() + cone.row, phi.data() + cone.row, cone.rows);
  return sum;
}

// z with the shift, and the slope of that.
void MixedSystem::scaled_velocity(Cone& cone, const double* y, double* z) const {
  double square = 0.0;
  z[0] = y[0];
  for (int r = 1; r < cone.rows; ++r) {
    z[r] = cone.scale[r] * y[r];
    square += z[r] * z[r];
  }
  if (!cone.coulomb) return;
  const double eta_square = cone.rho * (cone.k + cone.weight * center);
  const double root = std::sqrt(square + eta_square);
  if (root == 0.0) return;
  z[0] += share * square / (root + std::sqrt(eta_square));
  for (int r = 1; r < cone.rows; ++r) cone.slope[r] = share * z[r] / root;
}

// x becomes F_sigma(x); A and t of the cone are those at x.
void MixedSystem::evaluate(Cone& cone, double* x) const {
  const int n = cone.rows;
  const double k = cone.k + cone.weight * center;
  switch (cone.type) {
    case LawType::kEquality:
      for (int i = 0; i < n; ++i) x[i] /= -cone.sigma;
      cone.A.plus = cone.A.minus = cone.A.across = 1.0 / cone.sigma;
      return;
    case LawType::kDryFriction: {
      Law law;
      law.type = cone.type;
      law.regularizer = cone.sigma;
      law.smoothing = k;
      law.bound = cone.bound;
      double f, a;
      contact::evaluate(law, x, &f, &a);
      x[0] = f;
      cone.A = {a, a, a};
      return;
    }
    case LawType::kUnilateral:
    case LawType::kFrictionCone: {
      const double tau = radial_norm(x, n);
      const ScalarLaw plus(x[0] + tau, cone.sigma, k), minus(x[0] - tau, cone.sigma, k);
      const double sum = plus.s + minus.s;
      const double across = sum > 0.0 ? (plus.g + minus.g) / sum : 0.5 / cone.sigma;
      x[0] = 0.5 * (plus.g + minus.g);
      for (int i = 1; i < n; ++i) {
        cone.t[i] = tau > 0.0 ? x[i] / tau : 0.0;
        x[i] *= -across;
      }
      cone.A = {plus.a, minus.a, across};
      return;
    }
  }
}

double MixedSystem::residual(const Point& point) {
  system_->constraint_velocity(point.w.data(), y_.data());
  law_square_ = 0.0;
  for (Cone& cone : cones_) {
    const double* phi = point.phi.data() + cone.row;
    double* e = error_.data() + cone.row;
    scaled_velocity(cone, y_.data() + cone.row, e);
    for (int r = 0; r < cone.rows; ++r) e[r] -= (cone.sigma - cone.rho) * phi[r];
    evaluate(cone, e);
    for (int r = 0; r < cone.rows; ++r) {
      e[r] -= phi[r];
      law_square_ += cone.sigma * e[r] * e[r];
      f_[cone.row + r] = cone.scale[r] * phi[r];
    }
  }
  const double* free = system_->free_velocity();
  const double* inverse = system_->inverse_diagonal();
  for (size_t i = 0; i < dual_.size(); ++i) dual_[i] = point.w[i] - free[i];
  system_->multiply_mass(dual_.data(), momentum_.data());
  std::fill(dual_.begin(), dual_.end(), 0.0);
  double scale = system_->add_impulse(f_.data(), dual_.data());
  double norm = law_square_, energy = 0.0;
  for (size_t i = 0; i < dual_.size(); ++i) {
    dual_[i] -= momentum_[i];
    norm += dual_[i] * dual_[i] * inverse[i];
    scale += momentum_[i] * momentum_[i] * inverse[i];
    energy += (point.w[i] * point.w[i] + free[i] * free[i]) / inverse[i];
  }
  scale_ = std::sqrt(scale + kMomentumShare * kMomentumShare * energy);
  return std::sqrt(norm);
}

bool MixedSystem::factor() {
  for (Cone& cone : cones_) {
    const int n = cone.rows;
    double* G = hessian_.data() + cone.hessian;
    const double delta = cone.sigma - cone.rho;
    cone.B = {1.0 / (1.0 - delta * cone.A.plus), 1.0 / (1.0 - delta * cone.A.minus),
              1.0 / (1.0 - delta * cone.A.across)};
    const Spectral BA{cone.B.plus * cone.A.plus, cone.B.minus * cone.A.minus,
                      cone.B.across * cone.A.across};
    for (int j = 0; j < n; ++j) {
      double column[kMaxRows] = {}, out[kMaxRows];
      column[j] = 1.0;
      column[0] += cone.slope[j];
      apply(BA, cone.t, column, n, out);
      for (int i = 0; i < n; ++i) G[i * n + j] = cone.scale[i] * out[i] * cone.scale[j];
    }
  }
  return system_->factor(hessian_.data(), system_->unsymmetric());
}

// M dw - J'D dphi = dual,  dphi + A (S D J dw - (sigma - rho) dphi) = error.
void MixedSystem::solve(const std::vector<double>& dual, const std::vector<double>& error,
                        Point& out) {
  for (const Cone& cone : cones_) {
    double x[kMaxRows];
    apply(cone.B, cone.t, error.data() + cone.row, cone.rows, x);
    for (int r = 0; r < cone.rows; ++r) rhs_[cone.row + r] = cone.scale[r] * x[r];
  }
  out.w = dual;
  system_->add_impulse(rhs_.data(), out.w.data());
  system_->solve(out.w.data());
  system_->multiply_jacobian(out.w.data(), dy_.data());
  out.phi.resize(error.size());
  for (const Cone& cone : cones_) {
    const int n = cone.rows;
    double dz[kMaxRows], x[kMaxRows];
    for (int r = 0; r < n; ++r) dz[r] = cone.scale[r] * dy_[cone.row + r];
    for (int r = 1; r < n; ++r) dz[0] += cone.slope[r] * dz[r];
    apply(cone.A, cone.t, dz, n, x);
    for (int r = 0; r < n; ++r) x[r] = error[cone.row + r] - x[r];
    apply(cone.B, cone.t, x, n, out.phi.data() + cone.row);
  }
}

void MixedSystem::direction(Point& out) { solve(dual_, error_, out); }

void MixedSystem::remember() {
  dual_before_ = dual_;
  error_before_ = error_;
}

void MixedSystem::sensitivity(double difference, Point& out) {
  for (size_t i = 0; i < dual_.size(); ++i) dual_[i] = (dual_[i] - dual_before_[i]) / difference;
  for (size_t i = 0; i < error_.size(); ++i)
    error_[i] = (error_[i] - error_before_[i]) / difference;
  solve(dual_, error_, out);
}

double MixedSystem::inner(const Point& a, const Point& b) const {
  const double* inverse = system_->inverse_diagonal();
  double sum = 0.0;
  for (size_t i = 0; i < a.w.size(); ++i) sum += a.w[i] * b.w[i] / inverse[i];
  for (const Cone& cone : cones_)
    sum += cone.sigma * dot(a.phi.data() + cone.row, b.phi.data() + cone.row, cone.rows);
  return sum;
}

}  // namespace counterpoint::contact
