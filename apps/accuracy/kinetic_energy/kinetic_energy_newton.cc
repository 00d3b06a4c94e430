#include "accuracy/kinetic_energy/kinetic_energy_newton.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/linear/semidefinite_factor.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/line_search.h"

namespace counterpoint::contact {
namespace {

// Path of kappa: its start, the value below which the target is solved at once, its reduction
// factor, and the most Newton steps at each point and at the target.
constexpr double kPathStart = 1.0;
constexpr double kPathEnd = 1e-14;
constexpr double kPathFactor = 0.1;
constexpr int kPathSteps = 50;
constexpr int kTargetSteps = 200;
// A point on the path is solved when the next step would change no impulse by more than this
// fraction.
constexpr double kPathAccuracy = 0.1;
// The same for the target, before it is refined with p = -q'(v) eliminated.
constexpr double kRefine = 1e-9;
constexpr double kLineSearchAccuracy = 0.1;
// Fraction of the distance to p = 0 that a step may cover.
constexpr double kToBoundary = 0.95;
constexpr double kRankTolerance = 1e-14;
// Smallest inverse mass of a constraint used to scale the path, relative to the largest.
constexpr double kLeastInverseMass = 1e-6;
// Same as in newton.cc: a residual below this multiple of the round-off estimate counts as
// round-off.
constexpr double kFloorFactor = 4.0;
// Refinement ends when this many steps in a row have not halved the residual, or when it is far
// below the tolerance.
constexpr int kPatience = 3;
constexpr double kEnough = 0.01;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

}  // namespace

KineticEnergyNewton::KineticEnergyNewton(const KineticEnergyProblem& problem, const VectorX& c,
                                         const Settings& settings)
    : problem_(problem),
      c_(c),
      settings_(settings),
      laws_(problem.laws),
      bounds_(velocity_bounds(problem)),
      free_(c) {
  rank_ = factor_semidefinite(problem.A, kRankTolerance, L_);
  const auto bounds = static_cast<Eigen::Index>(bounds_.size());
  normal_.resize(bounds, rank_);
  for (Eigen::Index j = 0; j < bounds; ++j) {
    VelocityBound& bound = bounds_[j];
    bound.free = c[bound.row] + problem.gap_speed[bound.law];
    normal_.row(j) = L_.row(bound.row);
    speed_ = std::max(speed_, std::abs(bound.free));
  }
  int row = 0;
  for (const Law& law : laws_) {
    for (int r = 0; r < law.rows; ++r) {
      free_[row + r] += law.bias[r];
      speed_ = std::max(speed_, std::abs(free_[row + r]));
    }
    inverse_mass_.push_back(problem.A.diagonal().segment(row, law.rows).mean());
    row += law.rows;
  }
  double lightest = *std::max_element(inverse_mass_.begin(), inverse_mass_.end());
  if (!(lightest > 0.0)) lightest = 1.0;  // nothing can move: any scale works
  for (double& a : inverse_mass_) a = std::max(a, kLeastInverseMass * lightest);
  share_ = kMomentumShare * speed_ / std::sqrt(lightest);
}

// Widens every law to the width kappa V in velocity; false if none is wider than its target.
bool KineticEnergyNewton::set_path(double kappa) {
  bool above = false;
  const auto raise = [&](double target, double value) {
    above = above || value > target;
    return std::max(target, value);
  };
  for (size_t i = 0; i < laws_.size(); ++i) {
    const Law& target = problem_.laws[i];
    const double mu = std::max(kMinRegularizingFriction, target.friction[0]);
    const double hardening = target.type == LawType::kFrictionCone ? mu * mu : 1.0;
    const double k = kappa * speed_ * speed_ / inverse_mass_[i];
    laws_[i].smoothing = raise(target.smoothing, k);
    laws_[i].regularizer = raise(target.regularizer, kappa * inverse_mass_[i] / hardening);
  }
  for (VelocityBound& bound : bounds_) {
    bound.k =
        raise(problem_.velocity_smoothing, kappa * speed_ * speed_ / inverse_mass_[bound.law]);
    bound.s0 = raise(problem_.continuation_speed, 0.1 * kappa * speed_);
  }
  return above;
}

// Computes y, f, gradient and Hessian at x.
void KineticEnergyNewton::evaluate_here() {
  const auto bounds = static_cast<Eigen::Index>(bounds_.size());
  const auto u = x_.head(rank_), p = x_.tail(bounds);
  w_ = u + normal_.transpose() * p;
  y_ = free_ + L_ * u;
  f_.resize(y_.size());
  hessian_.resize(x_.size(), x_.size());
  hessian_.topLeftCorner(rank_, rank_).setIdentity();
  curvature_.clear();
  int row = 0;
  for (const Law& law : laws_) {
    const int n = law.rows;
    RowMatrix g(n, n);
    evaluate(law, y_.data() + row, f_.data() + row, g.data());
    const auto jacobian = L_.middleRows(row, n);
    hessian_.topLeftCorner(rank_, rank_) += jacobian.transpose() * (g * jacobian);
    curvature_.insert(curvature_.end(), g.data(), g.data() + n * n);
    row += n;
  }
  gradient_.resize(x_.size());
  gradient_.head(rank_) = w_ - L_.transpose() * f_;
  add_bounds();
}

// Adds the parts of gradient and Hessian that belong to p.
void KineticEnergyNewton::add_bounds() {
  const auto bounds = static_cast<Eigen::Index>(bounds_.size());
  gradient_.tail(bounds) = normal_ * w_;
  hessian_.bottomLeftCorner(bounds, rank_) = normal_;
  hessian_.bottomRightCorner(bounds, bounds) = normal_ * normal_.transpose();
  for (Eigen::Index j = 0; j < bounds; ++j) {
    const double p = x_[rank_ + j];
    gradient_[rank_ + j] += bounds_[j].free - bounds_[j].speed(p);
    hessian_(rank_ + j, rank_ + j) += bounds_[j].softness(p);
  }
}

bool KineticEnergyNewton::compute_step() {
  const Eigen::LLT<MatrixX> factor(hessian_);  // reads the lower triangle
  if (factor.info() != Eigen::Success) return false;
  step_ = -factor.solve(gradient_);
  y_step_ = L_ * step_.head(rank_);
  w_step_ = step_.head(rank_) + normal_.transpose() * step_.tail(normal_.rows());
  return step_.allFinite();
}

// Largest relative change of an impulse over the step.
double KineticEnergyNewton::relative_step() const {
  const double w_change = w_step_.norm();
  double largest = w_change > 0.0 ? w_change / w_.norm() : 0.0;
  size_t row = 0, at = 0;
  for (const Law& law : laws_) {
    const auto n = static_cast<size_t>(law.rows);
    const Eigen::Map<const RowMatrix> g(curvature_.data() + at, law.rows, law.rows);
    const double change = (g * y_step_.segment(row, n)).norm(), size = f_.segment(row, n).norm();
    if (change > 0.0) largest = std::max(largest, change / size);
    row += n;
    at += n * n;
  }
  for (Eigen::Index j = rank_; j < x_.size(); ++j) {
    largest = std::max(largest, std::abs(step_[j]) / x_[j]);
  }
  return largest;
}

// Longest step length that keeps p well above zero.
double KineticEnergyNewton::longest_step() const {
  double longest = std::numeric_limits<double>::infinity();
  for (Eigen::Index j = rank_; j < x_.size(); ++j) {
    if (step_[j] < 0.0) longest = std::min(longest, -kToBoundary * x_[j] / step_[j]);
  }
  return longest;
}

// Line search along the step to the minimum of the cost. False if round-off prevents any decrease.
bool KineticEnergyNewton::advance() {
  const double at_zero = gradient_.dot(step_);
  if (!(at_zero < 0.0)) return false;
  const double linear = w_.dot(w_step_), quadratic = w_step_.squaredNorm();
  VectorX trial(y_.size());
  const auto derivative = [&](double alpha) {
    Slope sum{linear + alpha * quadratic, quadratic};
    for (size_t j = 0; j < bounds_.size(); ++j) {
      const Eigen::Index at = rank_ + static_cast<Eigen::Index>(j);
      const double p = x_[at] + alpha * step_[at];
      if (!(p > 0.0)) return Slope{std::numeric_limits<double>::infinity(), 0.0};
      sum.first += (bounds_[j].free - bounds_[j].speed(p)) * step_[at];
      sum.second += bounds_[j].softness(p) * step_[at] * step_[at];
    }
    trial = y_ + alpha * y_step_;
    int row = 0;
    for (const Law& law : laws_) {
      const Slope s = slope(law, trial.data() + row, y_step_.data() + row);
      sum.first += s.first;
      sum.second += s.second;
      row += law.rows;
    }
    return sum;
  };
  const double longest = longest_step();
  if (longest < 1.0 && derivative(longest).first <= 0.0) {
    x_ += longest * step_;
    return true;
  }
  const LineSearchResult found = search_line(derivative, at_zero, kLineSearchAccuracy);
  if (!found.found) return false;
  x_ += found.step * step_;
  return true;
}

// Newton's method until the next step is small. False after `max_steps`, or where round-off stops
// it.
bool KineticEnergyNewton::minimize(double accuracy, int max_steps) {
  for (int step = 0;; ++step) {
    evaluate_here();
    if (!compute_step()) return false;
    if (relative_step() <= accuracy) return true;
    if (step == max_steps || iterations_ >= settings_.max_iterations) return false;
    ++iterations_;
    if (!advance()) return false;
  }
}

// Continues from wide laws to the target's.
void KineticEnergyNewton::follow_path() {
  for (double kappa = kPathStart; set_path(kappa) && kappa > kPathEnd; kappa *= kPathFactor)
    minimize(kPathAccuracy, kPathSteps);
  set_path(0.0);
  minimize(kRefine, kTargetSteps);
  evaluate_here();
}

double KineticEnergyNewton::residual(const VectorX& w, VectorX& v, VectorX& y, VectorX& f) const {
  v = c_ + L_ * w;
  kinetic_energy_impulse(problem_, v, y, f);
  double square = w.squaredNorm() + share_ * share_;
  int row = 0;
  for (const Law& law : laws_) {
    square += (L_.middleRows(row, law.rows).transpose() * f.segment(row, law.rows)).squaredNorm();
    row += law.rows;
  }
  const double gap = (w - L_.transpose() * f).norm();
  return gap > 0.0 ? gap / std::sqrt(square) : 0.0;
}

// Estimate of w - L'f due to round-off of v, of the products and of the sums, relative to |w|.
double KineticEnergyNewton::roundoff(const VectorX& w, const VectorX& v, const VectorX& y) const {
  const VectorX rounding = kEpsilon * (c_.cwiseAbs() + L_.cwiseAbs() * w.cwiseAbs());
  VectorX error = rounding + kEpsilon * (y.cwiseAbs() + v.cwiseAbs());
  for (const VelocityBound& bound : bounds_) {
    const double s = v[bound.row] + problem_.gap_speed[bound.law];
    const double uncertain = bound.stiffness(s) * (rounding[bound.row] + kEpsilon * std::abs(s)) +
                             kEpsilon * bound.impulse(s);
    error += uncertain * problem_.A.col(bound.row).cwiseAbs();
  }
  VectorX push = VectorX::Zero(rank_);
  int row = 0;
  for (const Law& law : problem_.laws) {
    const int n = law.rows;
    RowMatrix g(n, n);
    Rows f(n);
    evaluate(law, y.data() + row, f.data(), g.data());
    push += L_.middleRows(row, n).cwiseAbs().transpose() *
            (g.cwiseAbs() * error.segment(row, n) + kEpsilon * f.cwiseAbs());
    row += n;
  }
  return push.norm() / std::hypot(w.norm(), share_);
}

// Newton's method on w - L'f(w) = 0 with p a function of w, until it stops improving.
void KineticEnergyNewton::refine(KineticEnergyResult& out) {
  VectorX w = w_, best = w, v, y, f;
  out.residual = std::numeric_limits<double>::infinity();
  for (int useless = 0; useless < kPatience;) {
    const double here = residual(w, v, y, f);
    useless = here < 0.5 * out.residual ? 0 : useless + 1;
    if (here < out.residual || !std::isfinite(out.residual)) {
      out.residual = here;
      best = w;
    }
    if (here <= kEnough * settings_.tolerance || iterations_ == settings_.max_iterations) break;
    for (size_t j = 0; j < bounds_.size(); ++j) {
      const VelocityBound& bound = bounds_[j];
      x_[rank_ + static_cast<Eigen::Index>(j)] =
          bound.impulse(v[bound.row] + problem_.gap_speed[bound.law]);
    }
    x_.head(rank_) = w - normal_.transpose() * x_.tail(normal_.rows());
    evaluate_here();
    gradient_.tail(normal_.rows()).setZero();  // zero by the choice of p, up to round-off
    if (!compute_step()) break;
    w += w_step_;
    ++iterations_;
  }
  out.residual = residual(best, out.v, y, out.f);
  if (out.residual <= settings_.tolerance) {
    out.status = Status::kConverged;
  } else if (out.residual <= kFloorFactor * roundoff(best, out.v, y)) {
    out.status = Status::kRoundoffFloor;
  } else {
    out.status =
        iterations_ < settings_.max_iterations ? Status::kNoProgress : Status::kMaxIterations;
  }
}

void KineticEnergyNewton::solve(KineticEnergyResult& out) {
  set_path(kPathStart);
  x_.setZero(rank_ + normal_.rows());
  for (size_t j = 0; j < bounds_.size(); ++j) {
    x_[rank_ + static_cast<Eigen::Index>(j)] =
        bounds_[j].impulse(std::max(bounds_[j].free, bounds_[j].s0));
  }
  follow_path();
  refine(out);
  out.iterations = iterations_;
}

}  // namespace counterpoint::contact
