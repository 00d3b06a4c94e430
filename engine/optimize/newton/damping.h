// Levenberg-Marquardt damping of Gauss-Newton steps, relative to the diagonal (Nielsen, "Damping
// parameter in Marquardt's method", 1999).
#pragma once

#include <algorithm>
#include <cmath>

namespace counterpoint::optimization {

class Damping {
 public:
  /// Limit of trials of one step.
  static constexpr int kMaxTrials = 12;

  double value() const { return value_; }
  /// True if damping is so large that steps are negligible.
  static bool exhausted(double value) { return value > kMost; }
  /// True if trial number `trial` of a step, from 0, may be made.
  bool allows(int trial) const { return trial < kMaxTrials && !exhausted(value_); }
  /// Limits the damping at the start of a stage: failed trials are cheap, short steps are not.
  void begin() {
    value_ = std::min(value_, kFirst);
    growth_ = 2.0;
  }
  void set(double value) { value_ = value; }
  /// Sets a lower bound of the damping.
  void set_least(double least) {
    least_ = least;
    value_ = std::max(value_, least);
  }
  void limit(double most) { value_ = std::min(value_, most); }
  /// Increased damping after a factorization that was not positive definite with `value`.
  static double stronger(double value) { return std::max(10.0 * value, kLeast); }
  void strengthen() { value_ = stronger(value_); }
  /// Increases the damping after a step that did not lower the cost.
  void reject() {
    value_ *= 2.0 * growth_;
    growth_ *= 1.5;
  }
  /// Updates the damping after a step that lowered the cost by `decrease`, where the linear model
  /// predicted `expected`.
  void accept(double decrease, double expected) {
    const double gain = decrease / std::max(expected, 1e-300);
    const double factor = std::clamp(1.0 - std::pow(2.0 * gain - 1.0, 3), 0.1, 2.0);
    value_ = std::max(least_, value_ * factor);
    growth_ = 2.0;
  }

 private:
  static constexpr double kLeast = 1e-15, kMost = 1e8, kFirst = 1e-3;

  double value_ = kFirst, growth_ = 2.0, least_ = kLeast;
};

}  // namespace counterpoint::optimization
