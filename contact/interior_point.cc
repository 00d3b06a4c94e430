#include "counterpoint/contact/interior_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/jordan.h"
#include "counterpoint/contact/law.h"

namespace counterpoint::contact {
namespace {

// Share of the way to the boundary of the cones that a step may go.
constexpr double kFraction = 0.995;
// Done when the dual residual and the complementarity have come down to these, relative to the
// momentum exchanged and to the start: close enough for Newton's method to finish.
constexpr double kDualTolerance = 1e-9;
constexpr double kGapFactor = 20.0;
constexpr double kGapTolerance = 1e-15;
// A stalled run is still of use to Newton's method with a dual residual below this.
constexpr double kUsefulDual = 1e-4;
constexpr double kStalledStep = 0.05;
constexpr int kMaxStalled = 2;
// Start: complementarity as a share of the energy that closing and sliding constraints have in the
// free velocity.
constexpr double kStart = 0.1;
// Centering: bounds on Mehrotra's (1 - affine)^3, and how far below the mean the complementarity of
// one cone may fall; without both the steps can run in a circle.
constexpr double kLeastCentering = 1e-3;
constexpr double kMostCentering = 0.8;
constexpr double kUsefulPredictor = 0.1;
constexpr double kUsefulCorrector = 0.5;  // of the predictor's step, else the correction is dropped
constexpr double kCautiousCentering = 0.2;
constexpr double kNeighborhood = 1e-3;
constexpr double kOwnNeighborhood = 0.1;  // the same below its own target
constexpr double kShrink = 0.8;
constexpr int kMaxShrinks = 20;

bool has_cone(const Law& law) {
  return law.type == LawType::kUnilateral || law.type == LawType::kFrictionCone;
}

}  // namespace

void InteriorPoint::reserve(const IslandSystem& system) {
  for (auto* v : {&w_, &dw_, &dual_, &momentum_, &push_}) v->reserve(system.size());
  for (auto* v : {&y_, &f_, &s_, &phi_, &lambda_, &primal_, &rhs_, &ds_, &dphi_, &dy_})
    v->reserve(system.num_rows());
  hessian_.reserve(system.hessian_size());
  cones_.reserve(system.constraints().size());
}

// Starts on the law's own curve at a large smoothing: phi o s = center e and r_p = 0 hold exactly.
void InteriorPoint::begin(IslandSystem& system, const std::vector<double>& w) {
  system_ = &system;
  w_ = w;
  const size_t n = system.size(), m = system.num_rows();
  for (auto* v : {&dw_, &dual_, &momentum_, &push_}) v->assign(n, 0.0);
  for (auto* v : {&y_, &f_, &s_, &phi_, &lambda_, &primal_, &rhs_, &ds_, &dphi_, &dy_})
    v->assign(m, 0.0);
  hessian_.resize(system.hessian_size());
  system.constraint_velocity(system.free_velocity(), y_.data());
  double energy = 0.0;
  for (const auto& c : system.constraints()) {
    if (!has_cone(c.law)) continue;
    const double inverse_mass = c.inverse_mass;
    double square = std::pow(std::min(0.0, y_[c.row]), 2);
    for (int r = 1; r < c.law.rows; ++r)
      square += std::pow(c.law.friction[r - 1] * y_[c.row + r], 2);
    if (inverse_mass > 0.0) energy = std::max(energy, square / inverse_mass);
  }
  center_ = kStart * energy;
  system.constraint_velocity(w_.data(), y_.data());
  cones_.clear();
  for (size_t i = 0; i < system.constraints().size(); ++i) {
    const auto& c = system.constraints()[i];
    if (!has_cone(c.law)) continue;
    Cone cone;
    cone.constraint = static_cast<int>(i);
    cone.row = c.row;
    cone.rows = c.law.rows;
    cone.hessian = c.hessian;
    cone.k = c.law.smoothing;
    const bool friction = c.law.type == LawType::kFrictionCone;
    cone.rho = friction ? normal_regularizer(c.law) : c.law.regularizer;
    cone.scale[0] = 1.0;
    for (int r = 1; r < cone.rows; ++r) cone.scale[r] = c.law.friction[r - 1];
    Law law = c.law;
    law.smoothing = std::max(cone.k, center_);
    impulse(law, y_.data() + c.row, f_.data() + c.row);
    double* phi = phi_.data() + c.row;
    for (int r = 0; r < cone.rows; ++r)
      phi[r] = cone.scale[r] > 0.0 ? f_[c.row + r] / cone.scale[r] : 0.0;
    // s = smoothing inv(phi), the Jordan inverse.
    const double factor = law.smoothing / determinant(phi, cone.rows);
    s_[c.row] = factor * phi[0];
    for (int r = 1; r < cone.rows; ++r) s_[c.row + r] = -factor * phi[r];
    cones_.push_back(cone);
  }
}

// Nesterov and Todd's scaling of (s, phi). False if either has left its cone.
bool InteriorPoint::scale_cone(Cone& cone) {
  const int n = cone.rows;
  const double* s = s_.data() + cone.row;
  const double* phi = phi_.data() + cone.row;
  const double det_s = determinant(s, n), det_phi = determinant(phi, n);
  if (!(det_s > 0.0 && det_phi > 0.0 && s[0] > 0.0 && phi[0] > 0.0)) return false;
  const double norm_s = std::sqrt(det_s), norm_phi = std::sqrt(det_phi);
  const double gamma = std::sqrt(0.5 * (1.0 + dot(s, phi, n) / (norm_s * norm_phi)));
  double square = 0.0;
  for (int i = 1; i < n; ++i) {
    cone.t[i] = (s[i] / norm_s - phi[i] / norm_phi) / (2.0 * gamma);
    square += cone.t[i] * cone.t[i];
  }
  const double radial = std::sqrt(square);
  if (radial > 0.0)
    for (int i = 1; i < n; ++i) cone.t[i] /= radial;
  const double stretch = radial + std::sqrt(1.0 + square);
  const double eta = std::sqrt(norm_s / norm_phi);
  cone.W = {eta * stretch, eta / stretch, eta};
  cone.inverse = {1.0 / (cone.W.plus * cone.W.plus + cone.rho),
                  1.0 / (cone.W.minus * cone.W.minus + cone.rho), 1.0 / (eta * eta + cone.rho)};
  cone.determinant = norm_s * norm_phi;
  apply(cone.W, cone.t, phi, n, lambda_.data() + cone.row);
  return true;
}

// r_d = M(w - w*) - J'f, r_p = z + shift + rho phi - s, and the Hessians of laws without a cone.
void InteriorPoint::residuals(const std::vector<double>& w) {
  system_->constraint_velocity(w.data(), y_.data());
  for (const auto& c : system_->constraints()) {
    if (has_cone(c.law)) continue;
    Law law = c.law;
    law.smoothing = std::max(law.smoothing, center_);
    evaluate(law, y_.data() + c.row, f_.data() + c.row, hessian_.data() + c.hessian);
  }
  for (Cone& cone : cones_) {
    const Law& law = system_->constraints()[cone.constraint].law;
    const double* y = y_.data() + cone.row;
    double shifted = 0.0;
    if (law.coulomb) {
      Law smoothed = law;
      smoothed.smoothing = std::max(law.smoothing, center_);
      shifted = shift(smoothed, y);
    }
    for (int r = 0; r < cone.rows; ++r) {
      const int i = cone.row + r;
      f_[i] = cone.scale[r] * phi_[i];
      primal_[i] = cone.scale[r] * y[r] + cone.rho * phi_[i] - s_[i];
    }
    primal_[cone.row] += shifted;
  }
  const double* free = system_->free_velocity();
  for (size_t i = 0; i < w.size(); ++i) dual_[i] = w[i] - free[i];
  system_->multiply_mass(dual_.data(), momentum_.data());
  std::fill(push_.begin(), push_.end(), 0.0);
  double scale = system_->add_impulse(f_.data(), push_.data());
  double norm = 0.0;
  const double* inverse = system_->inverse_diagonal();
  for (size_t i = 0; i < w.size(); ++i) {
    dual_[i] = momentum_[i] - push_[i];
    norm += dual_[i] * dual_[i] * inverse[i];
    scale += momentum_[i] * momentum_[i] * inverse[i];
  }
  dual_norm_ = std::sqrt(norm);
  dual_scale_ = std::sqrt(scale);
}

// G of every cone, and the factors of M + J'GJ.
bool InteriorPoint::factor() {
  for (Cone& cone : cones_) {
    if (!scale_cone(cone)) return false;
    const int n = cone.rows;
    double* G = hessian_.data() + cone.hessian;
    for (int j = 0; j < n; ++j) {
      double column[kMaxRows] = {}, out[kMaxRows];
      column[j] = cone.scale[j];
      apply(cone.inverse, cone.t, column, n, out);
      for (int i = 0; i < n; ++i) G[i * n + j] = cone.scale[i] * out[i];
    }
  }
  return system_->factor(hessian_.data(), false);
}

// Newton direction towards phi o s = max(center, k) e; the corrector adds the second-order term of
// the direction that is there already.
void InteriorPoint::direction(bool corrector, double center) {
  std::fill(rhs_.begin(), rhs_.end(), 0.0);
  for (const Cone& cone : cones_) {
    const int n = cone.rows;
    const double* lambda = lambda_.data() + cone.row;
    double d[kMaxRows], x[kMaxRows];
    jordan_product(lambda, lambda, n, d);
    for (int r = 0; r < n; ++r) d[r] = -d[r];
    d[0] += std::max(center, cone.k);
    if (corrector) {
      // inv(W) ds and W dphi of the predictor; inv(W) has inverse eigenvalues.
      const Spectral inverse_W{1.0 / cone.W.plus, 1.0 / cone.W.minus, 1.0 / cone.W.across};
      double a[kMaxRows], b[kMaxRows], ab[kMaxRows];
      apply(inverse_W, cone.t, ds_.data() + cone.row, n, a);
      apply(cone.W, cone.t, dphi_.data() + cone.row, n, b);
      jordan_product(a, b, n, ab);
      for (int r = 0; r < n; ++r) d[r] -= ab[r];
    }
    jordan_divide(lambda, cone.determinant, d, n, x);
    double target[kMaxRows], out[kMaxRows];
    apply(cone.W, cone.t, x, n, target);
    for (int r = 0; r < n; ++r) target[r] -= primal_[cone.row + r];
    apply(cone.inverse, cone.t, target, n, out);
    for (int r = 0; r < n; ++r) {
      dphi_[cone.row + r] = target[r];  // completed below
      rhs_[cone.row + r] = cone.scale[r] * out[r];
    }
  }
  for (size_t i = 0; i < dw_.size(); ++i) dw_[i] = -dual_[i];
  system_->add_impulse(rhs_.data(), dw_.data());
  system_->solve(dw_.data());
  system_->multiply_jacobian(dw_.data(), dy_.data());
  for (const Cone& cone : cones_) {
    const int n = cone.rows;
    double dz[kMaxRows], target[kMaxRows], out[kMaxRows];
    for (int r = 0; r < n; ++r) dz[r] = cone.scale[r] * dy_[cone.row + r];
    for (int r = 0; r < n; ++r) target[r] = dphi_[cone.row + r] - dz[r];
    apply(cone.inverse, cone.t, target, n, out);
    for (int r = 0; r < n; ++r) {
      dphi_[cone.row + r] = out[r];
      ds_[cone.row + r] = dz[r] + cone.rho * out[r] + primal_[cone.row + r];
    }
  }
}

double InteriorPoint::longest_step() const {
  double step = std::numeric_limits<double>::infinity();
  for (const Cone& cone : cones_) {
    step = std::min(step, step_to_boundary(s_.data() + cone.row, ds_.data() + cone.row, cone.rows));
    step = std::min(step,
                    step_to_boundary(phi_.data() + cone.row, dphi_.data() + cone.row, cone.rows));
  }
  return step;
}

// The step, shortened until no cone's complementarity is far below the mean of all.
double InteriorPoint::central_step(double step, double gap, double target) const {
  const auto central = [&](double alpha) {
    double after[2][kMaxRows];
    const double mean = (1.0 - alpha) * gap;
    for (const Cone& cone : cones_) {
      for (int r = 0; r < cone.rows; ++r) {
        after[0][r] = s_[cone.row + r] + alpha * ds_[cone.row + r];
        after[1][r] = phi_[cone.row + r] + alpha * dphi_[cone.row + r];
      }
      const double bound = std::max(kOwnNeighborhood * std::min(cone.k, mean),
                                    kNeighborhood * (mean - kGapFactor * target));
      const double product = determinant(after[0], cone.rows) * determinant(after[1], cone.rows);
      if (product < bound * bound) return false;
    }
    return true;
  };
  for (int i = 0; i < kMaxShrinks && !central(step); ++i) step *= kShrink;
  return step;
}

double InteriorPoint::complementarity() const {
  double sum = 0.0;
  for (const Cone& cone : cones_)
    sum += dot(s_.data() + cone.row, phi_.data() + cone.row, cone.rows);
  return cones_.empty() ? 0.0 : sum / static_cast<double>(cones_.size());
}

int InteriorPoint::run(IslandSystem& system, int max_iterations, std::vector<double>& w) {
  begin(system, w);
  const double start = complementarity();
  double target = 0.0;
  for (const Cone& cone : cones_) target += cone.k / static_cast<double>(cones_.size());
  int stalled = 0;
  for (int iteration = 0; iteration <= max_iterations; ++iteration) {
    residuals(w_);
    if (!std::isfinite(dual_norm_)) return -iteration - 1;
    const double gap = complementarity();
    if (dual_norm_ <= kDualTolerance * dual_scale_ &&
        gap <= std::max(kGapFactor * target, kGapTolerance * start)) {
      w = w_;
      return iteration;
    }
    if (iteration == max_iterations || !factor()) return -iteration - 1;
    direction(false, 0.0);
    const double affine = std::min(1.0, longest_step());
    const double sigma = std::clamp(std::pow(1.0 - affine, 3), kLeastCentering, kMostCentering);
    // A predictor that leads nowhere says nothing of second order either.
    direction(affine > kUsefulPredictor, sigma * gap);
    double longest = longest_step();
    if (longest < kUsefulCorrector * affine) {
      direction(false, std::max(sigma, kCautiousCentering) * gap);
      longest = longest_step();
    }
    const double step = central_step(std::min(1.0, kFraction * longest), gap, target);
    stalled = step < kStalledStep ? stalled + 1 : 0;
    if (stalled > kMaxStalled) {
      const bool useful = dual_norm_ <= kUsefulDual * dual_scale_;
      if (useful) w = w_;
      return useful ? iteration : -iteration - 1;
    }
    for (size_t i = 0; i < w_.size(); ++i) w_[i] += step * dw_[i];
    for (size_t i = 0; i < s_.size(); ++i) {
      s_[i] += step * ds_[i];
      phi_[i] += step * dphi_[i];
    }
    center_ = std::max(sigma, 1.0 - step) * center_;
  }
  return -max_iterations - 1;
}

}  // namespace counterpoint::contact
