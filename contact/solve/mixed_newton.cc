#include "counterpoint/contact/solve/mixed_newton.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/solve/newton.h"

namespace counterpoint::contact {
namespace {

// Relative residual of a solution; Newton's method on velocities reduces it further.
constexpr double kTolerance = 1e-9;
// Largest number of halvings of a step; the last one is accepted in any case.
constexpr int kMixedHalvings = 4;
// A near start is given up if kGateSteps steps do not come near a solution.
constexpr int kGateSteps = 4;
// Below this relative residual, loads that are too small are raised.
constexpr double kRaiseBelow = 1e-5;
// A point is near enough to the path if the square of its residual is below kNear of the smoothing.
// The smoothing then falls by kFall, and by that much more each time that one step was enough,
// until one takes more than three.
constexpr double kNear = 0.1, kFall = 0.3;
// After kPatience steps that do not come near the path, smoothing is raised: kRaise times, or from
// none to the square of the residual over kRaise.
constexpr int kPatience = 10;
constexpr double kRaise = 100.0;

}  // namespace

void MixedNewton::reserve(const IslandSystem& system) { step_.reserve(system); }

// Takes one step, halved until the residual falls. False if the matrix is singular.
bool MixedNewton::advance(MixedSystem& system, MixedSystem::Point& point, double& norm) {
  if (!system.factor()) return false;
  system.direction(step_);
  double step = 1.0;
  for (int i = 0;; ++i, step *= 0.5) {
    const double after = system.trial(point, step_, step);
    if (after <= norm || i == kMixedHalvings) break;
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
    if (result.iterations == kGateSteps && result.residual > kNearSolution) return result;
    if (result.residual < kRaiseBelow && system.raise_loads(point)) norm = system.residual(point);
    if (!advance(system, point, norm)) return result;
  }
}

MixedNewton::Result MixedNewton::run_path(MixedSystem& system, int max_iterations, double smoothing,
                                          MixedSystem::Point& point) {
  Result result;
  const double laws = std::max(1, system.num_laws());
  system.extra_smoothing = smoothing;
  double norm = system.residual(point);
  double factor = kFall;
  int since = 0;
  for (;; ++result.iterations, ++since) {
    while (system.extra_smoothing > 0.0 && norm * norm <= kNear * laws * system.extra_smoothing) {
      if (since <= 1) factor *= kFall;
      if (since > 3) factor = std::min(kFall, std::sqrt(factor));
      since = 0;
      const double extra_smoothing = factor * system.extra_smoothing;
      const double negligible = kNear * kTolerance * system.scale();
      const bool none = extra_smoothing * laws < negligible * negligible;
      norm = system.resmooth(point, none ? 0.0 : extra_smoothing);
    }
    result.residual = norm / system.scale();
    result.solved = system.extra_smoothing == 0.0 && result.residual <= kTolerance;
    if (result.solved || !std::isfinite(norm) || result.iterations == max_iterations) return result;
    if (since > kPatience) {
      const double extra_smoothing = system.extra_smoothing > 0.0 ? kRaise * system.extra_smoothing
                                                                  : norm * norm / (kRaise * laws);
      factor = kFall;
      since = 0;
      norm = system.resmooth(point, extra_smoothing);
    }
    if (!advance(system, point, norm)) return result;
  }
}

}  // namespace counterpoint::contact
