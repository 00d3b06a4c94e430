#include "counterpoint/contact/mixed_newton.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::contact {
namespace {

constexpr double kTolerance = 1e-9;
// A residual that is not worth another step, as a share of its terms.
constexpr double kRounding = 1e-13;
constexpr int kMaxHalvings = 6;
constexpr double kSufficientDecrease = 1e-3;
// The center as a share of the laws' residual, a cone.
constexpr double kTheta = 0.1;
// After steps shorter than this the center is raised by that factor, and then falls more slowly.
constexpr double kShortStep = 0.1;
constexpr double kRaise = 100.0;
constexpr double kFirstFall = 0.05;

}  // namespace

void MixedNewton::reserve(const IslandSystem& system) {
  step_.reserve(system);
  trial_.reserve(system);
}

// One step, halved until the residual falls or no longer; returns its length, 0 if singular.
double MixedNewton::advance(MixedSystem& system, MixedSystem::Point& point, double& norm) {
  if (!system.factor()) return 0.0;
  system.direction(step_);
  double step = 1.0, after = 0.0;
  for (int i = 0;; ++i, step *= 0.5) {
    trial_ = point;
    trial_.add(step, step_);
    after = system.residual(trial_);
    if (after <= (1.0 - kSufficientDecrease * step) * norm || i == kMaxHalvings) break;
  }
  std::swap(point, trial_);
  norm = after;
  return step;
}

MixedNewton::Result MixedNewton::run_here(MixedSystem& system, int max_iterations, double square,
                                          MixedSystem::Point& point) {
  Result result;
  double norm = system.residual(point);
  for (;; ++result.iterations) {
    if (norm * norm <= square || norm <= kRounding * system.scale()) {
      result.solved = true;
      return result;
    }
    if (!std::isfinite(norm) || result.iterations == max_iterations) return result;
    if (advance(system, point, norm) == 0.0) return result;
  }
}

MixedNewton::Result MixedNewton::run(MixedSystem& system, int max_iterations, int max_raises,
                                     MixedSystem::Point& point) {
  Result result;
  const double theta = kTheta / std::max(1, system.num_cones());
  double norm = system.residual(point);
  double fall = 0.0;
  int raises = 0;
  if (system.center == 0.0) {
    system.center = theta * system.law_square();
    norm = system.residual(point);
  }
  for (;; ++result.iterations) {
    if (norm <= kTolerance * system.scale() && system.center > 0.0) {
      system.center = 0.0;
      norm = system.residual(point);
    }
    if (norm <= kTolerance * system.scale()) {
      result.solved = true;
      return result;
    }
    if (!std::isfinite(norm) || result.iterations == max_iterations) return result;
    const double step = advance(system, point, norm);
    if (step == 0.0) return result;
    const double goal = theta * system.law_square();
    if (step < kShortStep) {
      if (++raises > max_raises) return result;
      system.center = kRaise * std::max(system.center, goal);
      fall = fall == 0.0 ? kFirstFall : std::sqrt(fall);
      norm = system.residual(point);
    } else if (goal < system.center) {
      system.center = std::max(goal, fall * system.center);
      norm = system.residual(point);
    }
  }
}

}  // namespace counterpoint::contact
