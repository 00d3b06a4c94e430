#include "counterpoint/contact/island_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/law.h"

namespace counterpoint::contact {
namespace {

// Newton at the target smoothing is given this many steps before the path is taken.
constexpr int kDirectSteps = 4;
constexpr int kDirectStepsCoulomb = 8;
// More of them are due when the residual has come below this.
constexpr double kNearly = 0.3;
// Then the interior point is given this many, and Newton these from where it ends.
constexpr int kInteriorSteps = 60;
constexpr int kPolishSteps = 20;
// The path: where relative smoothing starts and what is small enough to jump to the target, how it
// shrinks, how well and in how many steps each point must be solved.
constexpr double kPathStart = 0.1;
constexpr double kPathEnd = 1e-14;
constexpr double kPathFactor = 0.1;
constexpr double kFastestFactor = 0.02;
constexpr double kSlowestFactor = 0.8;
constexpr double kPathTolerance = 2e-2;
constexpr int kPathSteps = 12;
constexpr int kEasySteps = 3;
constexpr int kTargetSteps = 60;
// The fixed point on the shift gives up after this many convex problems.
constexpr int kMaxShifts = 60;
constexpr double kSmallestStride = 0.2;
constexpr double kShiftTry = 0.3;

}  // namespace

int IslandSolver::steps_left(const Settings& settings) const {
  return std::max(0, settings.max_iterations - newton_.totals().iterations);
}

void IslandSolver::remember_targets(IslandSystem& system) {
  y_.resize(system.num_rows());
  system.constraint_velocity(system.free_velocity(), y_.data());
  double square = 0.0;  // of the fastest free constraint velocity
  for (const auto& c : system.constraints()) square = std::max(square, y_[c.row] * y_[c.row]);
  targets_.clear();
  for (const auto& c : system.constraints()) {
    const double inverse_mass = c.inverse_mass;
    const double unit = inverse_mass > 0.0 ? square / inverse_mass : 0.0;
    targets_.push_back(
        {c.law.smoothing, c.law.regularizer, unit, inverse_mass, c.law.bias[0], c.law.coulomb});
  }
}

// False if that is the target already.
bool IslandSolver::set_kappa(IslandSystem& system, double kappa) const {
  bool above = false;
  for (size_t i = 0; i < targets_.size(); ++i) {
    const Target& target = targets_[i];
    const double k = kappa * target.unit_smoothing, r = kappa * target.unit_regularizer;
    above = above || k > target.smoothing || r > target.regularizer;
    Law& law = system.constraints()[i].law;
    law.smoothing = std::max(target.smoothing, k);
    law.regularizer = std::max(target.regularizer, r);
  }
  return above;
}

// Solves for falling kappa, each point started from the two before by extrapolation: where the
// solution is strictly complementary, the path is smooth in kappa.
Newton::Result IslandSolver::follow_path(IslandSystem& system, const Settings& settings,
                                         std::vector<double>& w, std::vector<double>& f) {
  double kappa = kPathStart, factor = kPathFactor, solved = 1.0, before = 0.0;
  last_good_ = w;
  bool above = set_kappa(system, kappa);
  for (;;) {
    const bool target = !above || kappa < kPathEnd;
    if (target) set_kappa(system, 0.0);
    if (before > 0.0) {
      const double ratio = ((target ? 0.0 : kappa) - solved) / (solved - before);
      for (size_t i = 0; i < w.size(); ++i) start_[i] = w[i] + ratio * (w[i] - before_good_[i]);
      newton_.choose_better(start_, w);
    }
    const int left = steps_left(settings);
    const int target_steps = system.unsymmetric() ? kTargetSteps : left;
    const int steps = std::min(left, target ? target_steps : kPathSteps);
    const Newton::Result result =
        newton_.run(target ? settings.tolerance : kPathTolerance, steps, w, f);
    if (succeeded(result.status)) {
      if (target) return result;
      before_good_ = last_good_;
      before = solved < 1.0 ? solved : 0.0;
      last_good_ = w;
      solved = kappa;
      factor = std::max(kFastestFactor,
                        result.iterations <= kEasySteps ? 0.5 * factor : std::sqrt(0.1 * factor));
    } else {
      // Back to the last point solved, with the other line search first, then with a shorter
      // stride.
      w = last_good_;
      newton_.search_first = !newton_.search_first;
      if (newton_.search_first || !system.unsymmetric()) factor = std::sqrt(factor);
      if (factor > kSlowestFactor || steps_left(settings) == 0) {
        set_kappa(system, 0.0);
        return newton_.run(settings.tolerance, 0, w, f);
      }
    }
    kappa = solved * factor;
    above = set_kappa(system, kappa);
  }
}

// Convex problems with the shift of the one before as a bias: linear convergence, halved strides
// where it oscillates, and Newton wherever the change of the shift has fallen well.
Newton::Result IslandSolver::iterate_shift(IslandSystem& system, const Settings& settings,
                                           std::vector<double>& w, std::vector<double>& f) {
  shift_.assign(targets_.size(), 0.0);
  double stride = 1.0, last = std::numeric_limits<double>::infinity(), tried = last;
  newton_.search_first = true;
  Newton::Result result;
  for (int round = 0; round < kMaxShifts && steps_left(settings) > 0; ++round) {
    system.constraint_velocity(w.data(), y_.data());
    double change = 0.0;
    for (size_t i = 0; i < targets_.size(); ++i) {
      auto& c = system.constraints()[i];
      if (!targets_[i].coulomb) continue;
      const double target = shift(c.law, y_.data() + c.row);
      change = std::max(change, std::abs(target - shift_[i]));
      shift_[i] += (round == 0 ? 1.0 : stride) * (target - shift_[i]);
      c.law.coulomb = false;
      c.law.bias[0] = targets_[i].bias + shift_[i];
    }
    newton_.run(settings.tolerance, std::min(steps_left(settings), kDirectSteps), w, f);
    for (size_t i = 0; i < targets_.size(); ++i) {
      auto& c = system.constraints()[i];
      c.law.coulomb = targets_[i].coulomb;
      c.law.bias[0] = targets_[i].bias;
    }
    result = newton_.run(settings.tolerance, 0, w, f);
    if (succeeded(result.status)) return result;
    if (change > last) stride = std::max(kSmallestStride, 0.5 * stride);
    last = change;
    if (change > kShiftTry * tried) continue;
    tried = change;
    last_good_ = w;
    result = newton_.run(settings.tolerance, std::min(steps_left(settings), kPathSteps), w, f);
    if (succeeded(result.status)) return result;
    w = last_good_;
  }
  return newton_.run(settings.tolerance, 0, w, f);
}

Newton::Result IslandSolver::solve(IslandSystem& system, const Settings& settings,
                                   std::vector<double>& w, std::vector<double>& f) {
  newton_.begin(system);
  newton_.search_first = true;
  newton_.choose_start(w);
  const bool coulomb = system.unsymmetric();
  const int direct = coulomb ? kDirectStepsCoulomb : kDirectSteps;
  start_ = w;
  Newton::Result result =
      newton_.run(settings.tolerance, std::min(direct, settings.max_iterations), w, f);
  const auto unsolved = [&] {
    return !succeeded(result.status) && result.status != Status::kNotFinite &&
           steps_left(settings) > 0;
  };
  // Close already: quadratic convergence is at work.
  if (unsolved() && result.residual < kNearly) {
    result = newton_.run(settings.tolerance, std::min(steps_left(settings), kPolishSteps), w, f);
  }
  continued_ = unsolved();
  if (continued_) {
    w = start_;
    const int steps =
        interior_point_.run(system, std::min(steps_left(settings), kInteriorSteps), w);
    newton_.count(steps < 0 ? -steps - 1 : steps);
    if (steps >= 0)
      result = newton_.run(settings.tolerance, std::min(steps_left(settings), kPolishSteps), w, f);
  }
  if (unsolved()) {
    remember_targets(system);
    w = start_;
    result = follow_path(system, settings, w, f);
  }
  if (unsolved() && coulomb) result = iterate_shift(system, settings, w, f);
  if (!succeeded(result.status) && steps_left(settings) == 0)
    result.status = Status::kMaxIterations;
  result.iterations = newton_.totals().iterations;
  return result;
}

}  // namespace counterpoint::contact
