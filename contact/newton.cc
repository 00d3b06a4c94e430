#include "counterpoint/contact/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/law.h"
#include "counterpoint/contact/line_search.h"

namespace counterpoint::contact {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// An impulse is resolved to tolerance times this share of the momentum (solver.h, Report).
constexpr double kMomentumShare = 1e-4;
// |phi'(alpha)| / |phi'(0)| at which the line search is content. A step costs a factorization, a line
// search evaluation costs one pass over the rows.
constexpr double kLineSearchAccuracy = 0.1;
// Residuals this many times the round-off estimate cannot be told from zero.
constexpr double kFloorFactor = 4.0;

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

void Newton::resize(const IslandSystem& system) {
  const size_t n = system.size(), m = system.num_rows();
  for (auto* v : {&difference_, &momentum_, &gradient_, &step_, &mass_step_, &trial_}) v->resize(n);
  for (auto* v : {&y_, &y_step_, &y_trial_}) v->resize(m);
  hessian_.resize(system.hessian_size());
  residual_history_.clear();
  cost_history_.clear();
}

double Newton::cost(const std::vector<double>& w, const std::vector<double>& y) {
  const double* free = system_->free_velocity();
  for (size_t i = 0; i < w.size(); ++i) difference_[i] = w[i] - free[i];
  system_->multiply_mass(difference_.data(), momentum_.data());
  double sum = 0.5 * dot(difference_, momentum_);
  for (const auto& c : system_->constraints()) sum += potential(*c.law, y.data() + c.row);
  return sum;
}

// The given start or the free velocity, whichever costs less: a contact at rest starts well from the
// last velocity, a flight from the free one.
void Newton::choose_start(std::vector<double>& w) {
  const double* free = system_->free_velocity();
  trial_.assign(free, free + w.size());
  system_->constraint_velocity(w.data(), y_.data());
  const double given = cost(w, y_);
  system_->constraint_velocity(trial_.data(), y_.data());
  if (cost(trial_, y_) < given) w = trial_;
}

// y, f, G, gradient, its norm and the scale of its terms, all at w.
void Newton::evaluate(const std::vector<double>& w, std::vector<double>& f) {
  const double* free = system_->free_velocity();
  const double* inverse = system_->inverse_diagonal();
  system_->constraint_velocity(w.data(), y_.data());
  for (const auto& c : system_->constraints()) {
    contact::evaluate(*c.law, y_.data() + c.row, f.data() + c.row, hessian_.data() + c.hessian);
  }
  for (size_t i = 0; i < w.size(); ++i) difference_[i] = w[i] - free[i];
  system_->multiply_mass(difference_.data(), momentum_.data());
  double square = 0.0, share = 0.0;
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  square += system_->add_impulse(f.data(), gradient_.data());
  double norm = 0.0;
  for (size_t i = 0; i < w.size(); ++i) {
    gradient_[i] = momentum_[i] - gradient_[i];
    norm += gradient_[i] * gradient_[i] * inverse[i];
    square += momentum_[i] * momentum_[i] * inverse[i];
    share += (w[i] * w[i] + free[i] * free[i]) / inverse[i];
  }
  gradient_norm_ = std::sqrt(norm);
  scale_ = std::sqrt(square + kMomentumShare * kMomentumShare * share);
}

// Norm of the residual that rounding alone explains: y is known to eps |J||w|, hence f to |G| times
// that, and M(w - w*) to eps |M||w|.
double Newton::roundoff_floor(const std::vector<double>& w) {
  system_->velocity_roundoff(w.data(), y_trial_.data());
  for (const auto& c : system_->constraints()) {
    const int rows = c.law->rows;
    const double* g = hessian_.data() + c.hessian;
    double e[kMaxRows] = {};
    for (int r = 0; r < rows; ++r) {
      for (int s = 0; s < rows; ++s) e[r] += std::abs(g[r * rows + s]) * y_trial_[c.row + s];
    }
    std::copy(e, e + rows, y_trial_.data() + c.row);
  }
  std::fill(trial_.begin(), trial_.end(), 0.0);
  system_->add_absolute(y_trial_.data(), trial_.data());
  const double* free = system_->free_velocity();
  const double* inverse = system_->inverse_diagonal();
  double square = 0.0;
  for (size_t i = 0; i < w.size(); ++i) {
    const double mass_part = kEpsilon * (std::abs(w[i]) + std::abs(free[i])) / inverse[i];
    square += (trial_[i] + mass_part) * (trial_[i] + mass_part) * inverse[i];
  }
  return std::sqrt(square);
}

bool Newton::compute_direction() {
  if (!system_->factor(hessian_.data())) return false;
  for (size_t i = 0; i < step_.size(); ++i) step_[i] = -gradient_[i];
  system_->solve(step_.data());
  return true;
}

// Goes along step_ to where the cost is least. False if that is nowhere.
bool Newton::advance(std::vector<double>& w, int* evaluations) {
  const double at_zero = dot(gradient_, step_);
  if (!(at_zero < 0.0)) return false;
  system_->multiply_jacobian(step_.data(), y_step_.data());
  system_->multiply_mass(step_.data(), mass_step_.data());
  const double linear = dot(momentum_, step_), quadratic = dot(mass_step_, step_);
  const auto derivative = [&](double alpha) {
    Slope sum{linear + alpha * quadratic, quadratic};
    for (size_t i = 0; i < y_.size(); ++i) y_trial_[i] = y_[i] + alpha * y_step_[i];
    for (const auto& c : system_->constraints()) {
      const Slope s = slope(*c.law, y_trial_.data() + c.row, y_step_.data() + c.row);
      sum.first += s.first;
      sum.second += s.second;
    }
    return sum;
  };
  const LineSearchResult found = search_line(derivative, at_zero, kLineSearchAccuracy);
  *evaluations += found.evaluations;
  for (size_t i = 0; i < w.size(); ++i) w[i] += found.step * step_[i];
  return found.found;
}

Newton::Result Newton::solve(IslandSystem& system, const Settings& settings, std::vector<double>& w,
                             std::vector<double>& f) {
  system_ = &system;
  resize(system);
  Result result;
  choose_start(w);
  double best = std::numeric_limits<double>::infinity();
  bool moved = true;
  for (;;) {
    evaluate(w, f);
    result.residual = scale_ > 0.0 ? gradient_norm_ / scale_ : 0.0;
    residual_history_.push_back(result.residual);
    cost_history_.push_back(cost(w, y_));
    if (!std::isfinite(gradient_norm_)) {
      result.status = Status::kNotFinite;
      return result;
    }
    if (result.residual <= settings.tolerance) return result;
    // A step that did not reduce the residual, or a line search lost in noise: round-off, or failure?
    const bool stalled = !moved || gradient_norm_ > 0.5 * best;
    best = std::min(best, gradient_norm_);
    if (stalled && gradient_norm_ <= kFloorFactor * roundoff_floor(w)) {
      result.status = Status::kRoundoffFloor;
      return result;
    }
    if (!moved) {
      result.status = Status::kLineSearchFailed;
      return result;
    }
    if (result.iterations == settings.max_iterations) {
      result.status = Status::kMaxIterations;
      return result;
    }
    if (!compute_direction()) {
      result.status = Status::kSingular;
      return result;
    }
    moved = advance(w, &result.line_search_evaluations);
    ++result.iterations;
  }
}

}  // namespace counterpoint::contact
