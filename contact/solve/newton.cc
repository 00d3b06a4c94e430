#include "counterpoint/contact/solve/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// |phi'(alpha)| / |phi'(0)| at which the line search stops. A step costs a factorization, an
// evaluation of the line search one pass over the rows.
constexpr double kLineSearchAccuracy = 0.1;
// Scale [sqrt J] whose square underflows: an island with less momentum is at rest.
constexpr double kNothing = 1e-140;
// The round-off estimate holds within this factor: below the estimate over it a residual is
// certainly round-off, and up to the estimate times it one that no longer falls is. Rounding leaves
// about a tenth of the estimate, which is a bound.
constexpr double kFloorFactor = 4.0;
// A step that left at most kLineSearchAccuracy of the residual met the goal of a line search: the
// next one is taken whole. It also reuses the factors if kMostReused such steps would end the solve
// (E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", IV.8).
constexpr int kMostReused = 4;
// Largest number of halvings of a step on a residual that is not a gradient.
constexpr int kMaxHalvings = 10;

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

void Newton::begin(IslandSystem& system) {
  system_ = &system;
  const size_t n = system.size(), m = system.num_rows();
  for (auto* v : {&difference_, &momentum_, &gradient_, &step_, &mass_step_, &trial_}) v->resize(n);
  for (auto* v : {&y_, &y_step_, &y_trial_}) v->resize(m);
  hessian_.resize(system.hessian_size());
  totals_.iterations = totals_.line_search_evaluations = 0;
  evaluated_ = false;
  contraction_ = 1.0;
  totals_.residual_history.reserve(kUsualHistory);
  totals_.residual_history.clear();
}

void Newton::choose_start(bool loaded, std::vector<double>& w, std::vector<double>& f) {
  unsymmetric_ = system_->unsymmetric();
  evaluate_residual(w, f);
  const double given = gradient_norm_, scale = scale_;
  if (loaded || given < kNearSolution * scale) return;
  const double* free = system_->free_velocity();
  trial_.assign(free, free + w.size());
  // Puts the values at the given start aside.
  const auto exchange = [&] {
    y_.swap(y_trial_);
    f.swap(y_step_);
    momentum_.swap(mass_step_);
    gradient_.swap(step_);
  };
  exchange();
  evaluate_residual(trial_, f);
  if (gradient_norm_ < given) {
    w = trial_;
    return;
  }
  exchange();
  gradient_norm_ = given;
  scale_ = scale;
}

// Evaluates y, f, the gradient (or, with Coulomb laws, residual), its norm and the scale of its
// terms at w.
void Newton::evaluate_residual(const std::vector<double>& w, std::vector<double>& f) {
  const double* free = system_->free_velocity();
  const double* inverse = system_->inverse_diagonal();
  system_->constraint_velocity(w.data(), y_.data());
  system_->lanes().impulses(y_.data(), f.data());
  for (const int i : system_->single()) {
    const auto& c = system_->constraints()[i];
    impulse(c.law, y_.data() + c.row, f.data() + c.row);
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
  evaluated_ = true;
  linearized_ = recorded_ = false;
}

// Returns the norm of the residual that rounding alone explains: y is known to eps |J||w|, hence f
// to |G| times that, and M(w - w*) to eps |M||w|.
double Newton::roundoff_floor(const std::vector<double>& w) {
  linearize();
  system_->velocity_roundoff(w.data(), y_trial_.data());
  for (const auto& c : system_->constraints()) {
    const int rows = c.law.rows;
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

// Evaluates G of all laws at the point of the residual.
void Newton::linearize() {
  if (linearized_) return;
  linearized_ = true;
  system_->lanes().hessians(y_.data(), hessian_.data());
  double f[kMaxRows];
  for (const int i : system_->single()) {
    const auto& c = system_->constraints()[i];
    evaluate(c.law, y_.data() + c.row, f, hessian_.data() + c.hessian);
  }
}

// Returns whether simplified Newton steps, with the present factors and the last contraction, would
// soon converge.
bool Newton::factors_suffice(double tolerance) const {
  return contraction_ <= kLineSearchAccuracy &&
         residual_ * std::pow(contraction_, kMostReused) <= tolerance;
}

bool Newton::factor() {
  linearize();
  return system_->factor(hessian_.data(), unsymmetric_);
}

void Newton::solve_direction() {
  for (size_t i = 0; i < step_.size(); ++i) step_[i] = -gradient_[i];
  system_->solve(step_.data());
}

// Takes a step along step_. False if none reduces the residual, except with reused factors: new
// ones may help.
bool Newton::advance(std::vector<double>& w, std::vector<double>& f, bool reused) {
  const double before = gradient_norm_;
  bool moved = contraction_ <= kLineSearchAccuracy && take_step(1.0, before, w, f);
  if (!moved && !reused) {
    if (!evaluated_) evaluate_residual(w, f);
    moved = unsymmetric_ ? advance_residual(w, f) : advance_cost(w);
  }
  if (!evaluated_) evaluate_residual(w, f);
  contraction_ = moved ? gradient_norm_ / before : 1.0;
  return moved || reused;
}

// Moves w by alpha step_, and back if that does not reduce the residual.
bool Newton::take_step(double alpha, double before, std::vector<double>& w,
                       std::vector<double>& f) {
  trial_ = w;
  for (size_t i = 0; i < w.size(); ++i) w[i] += alpha * step_[i];
  evaluate_residual(w, f);
  ++totals_.line_search_evaluations;
  if (gradient_norm_ < before) return true;
  w = trial_;
  evaluated_ = false;
  return false;
}

// Finds the zero of the residual's component along step_: with a cost, its minimum.
LineSearchResult Newton::search_step() {
  LineSearchResult nowhere;
  const double at_zero = dot(gradient_, step_);
  if (!(at_zero < 0.0)) return nowhere;
  system_->multiply_jacobian(step_.data(), y_step_.data());
  system_->multiply_mass(step_.data(), mass_step_.data());
  const double linear = dot(momentum_, step_), quadratic = dot(mass_step_, step_);
  const auto derivative = [&](double alpha) {
    Slope sum{linear + alpha * quadratic, quadratic};
    for (size_t i = 0; i < y_.size(); ++i) y_trial_[i] = y_[i] + alpha * y_step_[i];
    system_->lanes().add_slope(y_trial_.data(), y_step_.data(), sum);
    for (const int i : system_->single()) {
      const auto& c = system_->constraints()[i];
      const Slope s = slope(c.law, y_trial_.data() + c.row, y_step_.data() + c.row);
      sum.first += s.first;
      sum.second += s.second;
    }
    return sum;
  };
  const LineSearchResult found = search_line(derivative, at_zero, kLineSearchAccuracy);
  totals_.line_search_evaluations += found.evaluations;
  return found;
}

bool Newton::advance_cost(std::vector<double>& w) {
  const LineSearchResult found = search_step();
  for (size_t i = 0; i < w.size(); ++i) w[i] += found.step * step_[i];
  evaluated_ = false;
  return found.found;
}

// Moves to the zero along the step if the residual is smaller there, else halves the step until it
// is; leaves w unchanged if it never is.
bool Newton::advance_residual(std::vector<double>& w, std::vector<double>& f) {
  const double before = gradient_norm_;
  // The zero of the residual along the step is usually far better than the full step.
  const LineSearchResult found = search_step();
  if (found.found && found.step != 1.0 && take_step(found.step, before, w, f)) return true;
  double alpha = 1.0;
  for (int i = 0; i < kMaxHalvings; ++i, alpha *= 0.5) {
    if (take_step(alpha, before, w, f)) return true;
  }
  return false;
}

void Newton::record() {
  recorded_ = true;
  residual_ = scale_ > kNothing ? gradient_norm_ / scale_ : 0.0;
  totals_.residual_history.push_back(residual_);
}

// Decides whether the residual is round-off. It is in doubt after a step with new factors that did
// not halve it, or after a step that failed. Otherwise, for instance at the start, it must be
// round-off for certain; above the square root of epsilon Newton's method, which doubles the number
// of digits, is not about to end, and the estimate is not worth its cost.
bool Newton::at_floor(bool moved, bool reused, double best, const std::vector<double>& w) {
  const bool in_doubt = !moved || (!reused && gradient_norm_ > 0.5 * best);
  if (!in_doubt && residual_ > std::sqrt(kEpsilon)) return false;
  return gradient_norm_ <= (in_doubt ? kFloorFactor : 1.0 / kFloorFactor) * roundoff_floor(w);
}

Newton::Result Newton::run(double tolerance, int max_iterations, std::vector<double>& w,
                           std::vector<double>& f, double contraction) {
  unsymmetric_ = system_->unsymmetric();
  contraction_ = contraction;
  evaluated_ = false;
  return resume(tolerance, max_iterations, w, f);
}

Newton::Result Newton::resume(double tolerance, int max_iterations, std::vector<double>& w,
                              std::vector<double>& f) {
  Result result;
  const auto stop = [&](Status status) {
    result.status = status;
    return result;
  };
  double best = std::numeric_limits<double>::infinity();
  bool moved = true, reused = false;
  for (;;) {
    if (!evaluated_) evaluate_residual(w, f);
    if (!recorded_) record();
    result.residual = residual_;
    if (!std::isfinite(gradient_norm_)) return stop(Status::kNotFinite);
    if (residual_ <= tolerance) return result;
    if (at_floor(moved, reused, best, w)) return stop(Status::kRoundoffFloor);
    best = std::min(best, gradient_norm_);
    if (!moved) return stop(Status::kNoProgress);
    reused = factors_suffice(tolerance);
    if (!reused) {
      if (result.iterations == max_iterations) return stop(Status::kMaxIterations);
      if (!factor()) return stop(Status::kSingular);
      ++result.iterations;
      ++totals_.iterations;
    }
    solve_direction();
    moved = advance(w, f, reused);
  }
}

}  // namespace counterpoint::contact
