#include "counterpoint/contact/homotopy.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint::contact {
namespace {

// c0 as a share of the energy that each constraint by itself would take up, a cone.
constexpr double kStart = 0.1;
constexpr int kStartSteps = 60;
constexpr int kMaxRaises = 4;
constexpr double kRaise = 100.0;
// Arc length: a decade of the center is one unit.
constexpr double kUnit = 2.302585092994046;
constexpr double kFirstStep = 1.0, kLongestStep = 3.0, kShortestStep = 1e-6;
constexpr double kGrow = 2.0, kShrink = 0.3;
// Steps as short as this may turn as they like: a kink.
constexpr double kSharp = 1e-3;
// A point of the curve is good when the square of the residual is below this share of the center,
// a cone.
constexpr double kAccuracy = 1e-4;
constexpr double kStartAccuracy = 1e-16;
// And when its steps are shorter than kMove of the scale and contract to kSettled of the last one,
// or are shorter than kSmallMove; steps that do not contract to kContraction end the attempt.
constexpr double kMove = 1e-4, kContraction = 0.9, kSettled = 0.3, kSmallMove = 1e-6;
constexpr int kCorrectorHalvings = 4;
constexpr int kCorrectorSteps = 15, kEasySteps = 3;
// The target is tried from here on, again after this many decades, in so many steps.
constexpr double kFirstJump = 2.0, kBetweenJumps = 2.0;
constexpr int kJumpSteps = 12;
// The end: the center as a share of the square of the scale, a cone. Given up further on than the
// second, the point may still do as a start.
constexpr double kEnd = 1e-20, kUseful = 1e-10;
constexpr int kEndSteps = 10;
constexpr double kDifference = 1e-4;

}  // namespace

void Homotopy::reserve(const IslandSystem& system) {
  for (Curve* curve : {&here_, &trial_, &before_, &tangent_, &next_tangent_})
    curve->point.reserve(system);
  for (MixedSystem::Point* point : {&step_, &slope_, &jump_}) point->reserve(system);
}

void Homotopy::set_parameter(MixedSystem& system, double p) const {
  const double share = std::exp(-p);
  system.center = start_center_ * share;
  system.share = 1.0 - share;
}

double Homotopy::inner(const MixedSystem& system, const Curve& a, const Curve& b) const {
  return system.inner(a.point, b.point) + metric_ * a.p * b.p;
}

// Solves the convex problem at p = 0, with more smoothing where that fails.
bool Homotopy::start(MixedSystem& system, MixedNewton& newton, MixedSystem::Point& point) {
  system.center = system.share = 0.0;
  jump_ = point;
  system.guess(jump_.phi);
  start_center_ = kStart * system.impulse_square(jump_.phi) / cones_;
  for (int i = 0; i < kMaxRaises && used_ < budget_; ++i, start_center_ *= kRaise) {
    here_.point = jump_;
    here_.p = 0.0;
    set_parameter(system, 0.0);
    const auto result = newton.run_here(system, std::min(kStartSteps, budget_ - used_),
                                        kStartAccuracy * start_center_ * cones_, here_.point);
    used_ += result.iterations;
    if (result.solved) {
      // To rounding: a weakly determined impulse needs more than a small residual.
      used_ += newton.run_here(system, kEndSteps, 0.0, here_.point).iterations;
      return true;
    }
  }
  return false;
}

// Newton's method in the hyperplane across the tangent, from trial_, steps halved while the
// residual does not fall.
bool Homotopy::correct(MixedSystem& system, int& iterations) {
  const double allowed = kAccuracy * cones_;
  set_parameter(system, trial_.p);
  double norm = system.residual(trial_.point);
  double move = std::numeric_limits<double>::infinity();
  bool settled = false;
  for (iterations = 0;; ++iterations) {
    if (!std::isfinite(norm)) return false;
    if (settled && norm * norm <= allowed * system.center) return true;
    if (iterations == kCorrectorSteps || used_ >= budget_ || !system.factor()) return false;
    ++used_;
    system.direction(step_);
    system.remember();
    set_parameter(system, trial_.p + kDifference);
    system.residual(trial_.point);
    system.sensitivity(kDifference, slope_);
    const double across = system.inner(tangent_.point, step_);
    const double along = system.inner(tangent_.point, slope_) + metric_ * tangent_.p;
    const double dp = along != 0.0 ? -across / along : 0.0;
    step_.add(dp, slope_);
    before_ = trial_;
    const double center = start_center_ * std::exp(-trial_.p);
    double length = 1.0, after = 0.0;
    for (int i = 0; i <= kCorrectorHalvings; ++i, length *= 0.5) {
      trial_ = before_;
      trial_.point.add(length, step_);
      trial_.p += length * dp;
      set_parameter(system, trial_.p);
      after = system.residual(trial_.point);
      if (after < norm) break;
    }
    const double last = move;
    move = std::sqrt(system.inner(step_, step_));
    if (!(after < norm)) {  // rounding, if the step is short
      trial_ = before_;
      return move <= kMove * system.scale() && norm * norm <= allowed * center;
    }
    // Steps that grow while the residual falls: there is no solution near, only a weakly determined
    // direction in which to run away from the curve.
    const bool small = move <= kSmallMove * system.scale();
    if (move > kContraction * last && !small) return false;
    settled =
        small || (move <= kMove * system.scale() && move <= kSettled * last && std::isfinite(last));
    norm = after;
  }
}

// The unit tangent at a point of the curve, forwards: in p where the derivative's determinant is
// positive, backwards where it is negative, which holds along the whole curve.
bool Homotopy::find_tangent(MixedSystem& system, const Curve& at, Curve& tangent) {
  set_parameter(system, at.p);
  system.residual(at.point);
  metric_ = system.scale() * system.scale() / (kUnit * kUnit);
  if (!system.factor()) return false;
  ++used_;
  system.remember();
  set_parameter(system, at.p + kDifference);
  system.residual(at.point);
  system.sensitivity(kDifference, tangent.point);
  tangent.p = 1.0;
  const double length = system.determinant_sign() * std::sqrt(inner(system, tangent, tangent));
  for (auto* v : {&tangent.point.w, &tangent.point.phi}) {
    for (double& x : *v) x /= length;
  }
  tangent.p /= length;
  return true;
}

// One step along the curve, shortened until the corrector arrives and the tangent has not turned
// too far: else another branch may have been reached.
bool Homotopy::advance(MixedSystem& system) {
  step_length_ = std::min(step_length_, kLongestStep / (std::abs(tangent_.p) * std::sqrt(metric_)));
  const double unit = kUnit * std::sqrt(metric_);
  const double metric = metric_;
  for (; step_length_ >= kShortestStep && used_ < budget_; step_length_ *= kShrink) {
    trial_ = here_;
    trial_.point.add(step_length_ * unit, tangent_.point);
    trial_.p += tangent_.p * step_length_ * unit;
    int iterations = 0;
    metric_ = metric;
    if (!correct(system, iterations)) continue;
    if (!find_tangent(system, trial_, next_tangent_)) continue;
    const bool turned = inner(system, tangent_, next_tangent_) < least_cosine_;
    if (turned && step_length_ > kSharp) continue;
    std::swap(here_, trial_);
    std::swap(tangent_, next_tangent_);
    if (iterations <= kEasySteps) step_length_ *= kGrow;
    return true;
  }
  return false;
}

// The center has come down to this share of the square of the scale, a cone.
bool Homotopy::reached(MixedSystem& system, double share) {
  set_parameter(system, here_.p);
  system.residual(here_.point);
  return system.center * cones_ < share * system.scale() * system.scale();
}

MixedNewton::Result Homotopy::run(MixedSystem& system, MixedNewton& newton, double least_cosine,
                                  int max_iterations, MixedSystem::Point& point) {
  least_cosine_ = least_cosine;
  budget_ = max_iterations;
  used_ = 0;
  cones_ = std::max(1, system.num_cones());
  step_length_ = kFirstStep;
  MixedNewton::Result out;
  const bool started = start(system, newton, point) && find_tangent(system, here_, tangent_);
  double next_jump = kFirstJump * kUnit;
  while (started && !out.solved && advance(system) && !reached(system, kEnd)) {
    if (here_.p < next_jump) continue;
    next_jump = here_.p + kBetweenJumps * kUnit;
    jump_ = here_.point;
    system.share = 1.0;
    const auto result = newton.run(system, std::min(kJumpSteps, budget_ - used_), jump_);
    used_ += result.iterations;
    out.solved = result.solved;
  }
  if (out.solved) {
    std::swap(point, jump_);
  } else if (started && reached(system, kUseful)) {
    std::swap(point, here_.point);
    used_ += newton.run_here(system, kEndSteps, 0.0, point).iterations;
    out.solved = true;
  }
  out.iterations = used_;
  return out;
}

}  // namespace counterpoint::contact
