#include "counterpoint/contact/solve/mixed_newton.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::contact {
namespace {

// Relative residual of a solution; Newton's method on velocities reduces it further.
constexpr double kTolerance = 1e-9;
// Required decrease of the residual, and largest number of halvings of a step; the last one is
// accepted in any case.
constexpr double kResidualDecrease = 1e-3;
constexpr int kNearHalvings = 4, kPathHalvings = 5;
// A near start is given up if kGateSteps steps leave the relative residual above kGate.
constexpr int kGateSteps = 4;
constexpr double kGate = 0.3;
// Below this relative residual, loads that are too small are raised, at most by kMostRaise in a
// step.
constexpr double kRaiseBelow = 1e-5, kMostRaise = 100.0;
// A point is near enough to the path if the square of its residual is below kNear of the smoothing.
// The smoothing then falls by a factor, which decreases if one step was enough and increases if
// more than three were needed.
constexpr double kNear = 0.1;
constexpr double kFirstFactor = 0.3, kLeastFactor = 1e-4, kMostFactor = 0.5;
// Smoothing below this share of the square of the scale counts as none.
constexpr double kNoSmoothing = 1e-20;
// After kPatience steps that do not come near the path, smoothing is raised again, at most
// kMaxRaises times.
constexpr int kPatience = 10, kMaxRaises = 3;
constexpr double kRaise = 100.0, kRaiseFromNone = 1e-2;

}  // namespace

void MixedNewton::reserve(const IslandSystem& system) { step_.reserve(system); }

// Takes one step, halved until the residual falls, at most max_halvings times. False if the matrix
// is singular.
bool MixedNewton::advance(MixedSystem& system, int max_halvings, MixedSystem::Point& point,
                          double& norm) {
  if (!system.factor()) return false;
  system.direction(step_);
  double step = 1.0;
  for (int i = 0;; ++i, step *= 0.5) {
    const double after = system.trial(point, step_, step);
    if (after <= (1.0 - kResidualDecrease * step) * norm || i == max_halvings) break;
  }
  norm = system.accept(step_, point);
  return true;
}

MixedNewton::Result MixedNewton::run_near(MixedSystem& system, int max_iterations,
                                          MixedSystem::Point& point) {
  Result result;
  system.extra_smoothing = 0.0;
  double norm = system.residual(point);
  for (;; ++result.iterations) {
    result.residual = norm / system.scale();
    result.solved = result.residual <= kTolerance;
    if (result.solved || !std::isfinite(norm) || result.iterations == max_iterations) return result;
    if (result.iterations == kGateSteps && result.residual > kGate) return result;
    if (result.residual < kRaiseBelow && system.raise_loads(kMostRaise, point))
      norm = system.residual(point);
    if (!advance(system, kNearHalvings, point, norm)) return result;
  }
}

MixedNewton::Result MixedNewton::run_path(MixedSystem& system, int max_iterations, double smoothing,
                                          MixedSystem::Point& point) {
  Result result;
  const double laws = std::max(1, system.num_laws());
  system.extra_smoothing = smoothing;
  double norm = system.residual(point);
  double factor = kFirstFactor;
  int since = 0, raises = 0;
  for (;; ++result.iterations, ++since) {
    while (system.extra_smoothing > 0.0 && norm * norm <= kNear * laws * system.extra_smoothing) {
      if (since <= 1) factor = std::max(kLeastFactor, factor * kFirstFactor);
      if (since > 3) factor = std::min(kMostFactor, std::sqrt(factor));
      since = 0;
      const double extra_smoothing = factor * system.extra_smoothing;
      const bool none = extra_smoothing * laws < kNoSmoothing * system.scale() * system.scale();
      norm = system.resmooth(point, none ? 0.0 : extra_smoothing);
    }
    result.residual = norm / system.scale();
    result.solved = system.extra_smoothing == 0.0 && result.residual <= kTolerance;
    if (result.solved || !std::isfinite(norm) || result.iterations == max_iterations) return result;
    if (since > kPatience) {
      if (++raises > kMaxRaises) return result;
      const double extra_smoothing = system.extra_smoothing > 0.0
                                         ? kRaise * system.extra_smoothing
                                         : kRaiseFromNone * norm * norm / laws;
      factor = kFirstFactor;
      since = 0;
      norm = system.resmooth(point, extra_smoothing);
    }
    if (!advance(system, kPathHalvings, point, norm)) return result;
  }
}

}  // namespace counterpoint::contact
