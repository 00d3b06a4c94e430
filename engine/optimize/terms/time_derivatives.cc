// Derivatives of forces by log h, with the frames of a motion held.
#include <cmath>

#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {
namespace {

/// Difference step of log h. With the frames the gaps at the end of a step are held, so that forces
/// change little with h, about as 1/h^2: the error is of the order of kStep^2.
constexpr double kStep = 1e-4;

}  // namespace

int rate_order(Quantity quantity) {
  switch (quantity) {
    case Quantity::kVelocity:
    case Quantity::kPointVelocity:
    case Quantity::kSliding:
    case Quantity::kMomentum:
    case Quantity::kAngularMomentum:
      return 1;
    case Quantity::kAcceleration:
      return 2;
    case Quantity::kDuration:
      return -1;
    default:
      return 0;
  }
}

/// Finds the first two derivatives of the applied force by log h. Needs inverse_.
void Evaluator::differentiate_by_time(const Stage& stage) {
  changed_options_ = stage.options;
  for (const double side : {kStep, -kStep}) {
    const double factor = std::exp(side);
    changed_options_.time_step = h_ * factor;
    value_ = v_ / factor;
    weight_ = w_ / factor;
    step_inverse(*model_, changed_options_, q_, value_, weight_, nothing_, workspace_,
                 side > 0.0 ? slow_ : quick_);
  }
  force_by_time_ = (slow_.applied_force - quick_.applied_force) / (2.0 * kStep);
  force_curvature_ =
      (slow_.applied_force - 2.0 * inverse_.applied_force + quick_.applied_force) / (kStep * kStep);
}

/// Returns the same of the contact force on a body.
std::pair<Vector3, Vector3> Evaluator::contact_force_by_time(int body) const {
  const Vector3 slow = contact_force_on(*model_, slow_, body);
  const Vector3 quick = contact_force_on(*model_, quick_, body);
  const Vector3 now = contact_force_on(*model_, inverse_, body);
  return {(slow - quick) / (2.0 * kStep), (slow - 2.0 * now + quick) / (kStep * kStep)};
}

}  // namespace counterpoint::optimization
