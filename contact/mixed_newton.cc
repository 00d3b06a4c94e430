#include "counterpoint/contact/mixed_newton.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::contact {
namespace {

constexpr double kTolerance = 1e-9;
// A residual that is not worth another step, as a share of its terms.
constexpr double kRounding = 1e-13;
// Of a step; without a center that follows it has to fall.
constexpr int kMaxHalvings = 4, kMaxHalvingsHere = 6;
constexpr double kSufficientDecrease = 1e-3;
// The center as a share of the laws' residual, a cone.
constexpr double kTheta = 0.3;

}  // namespace

void MixedNewton::reserve(const IslandSystem& system) {
  step_.reserve(system);
  trial_.reserve(system);
}

// One step, halved until the residual falls or no longer; false if singular.
bool MixedNewton::advance(MixedSystem& system, int max_halvings, MixedSystem::Point& point,
                          double& norm) {
  if (!system.factor()) return false;
  system.direction(step_);
  double step = 1.0, after = 0.0;
  for (int i = 0;; ++i, step *= 0.5) {
    trial_ = point;
    trial_.add(step, step_);
    after = system.residual(trial_);
    if (after <= (1.0 - kSufficientDecrease * step) * norm || i == max_halvings) break;
  }
  std::swap(point, trial_);
  norm = after;
  return true;
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
    if (!advance(system, kMaxHalvingsHere, point, norm)) return result;
  }
}

MixedNewton::Result MixedNewton::run(MixedSystem& system, int max_iterations,
                                     MixedSystem::Point& point) {
  Result result;
  const double theta = kTheta / std::max(1, system.num_cones());
  double norm = system.residual(point);
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
    if (!advance(system, kMaxHalvings, point, norm)) return result;
    const double goal = theta * system.law_square();
    if (goal < system.center) {
      system.center = goal;
      norm = system.residual(point);
    }
  }
}

}  // namespace counterpoint::contact
