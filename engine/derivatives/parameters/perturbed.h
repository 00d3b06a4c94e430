// Where to take differences by one parameter of a model.
#pragma once

#include <array>

#include "counterpoint/engine/derivatives.h"

namespace counterpoint {

/// df/dp = sum of weight[i] f(p + at[i]): central differences extrapolated from two steps, or where
/// the figure must not be negative and is (nearly) zero, differences to one side, of third order.
struct DifferenceScheme {
  std::array<double, 4> at, weight;

  template <class T>
  T operator()(const std::array<T, 4>& f) const {
    return f[0] * weight[0] + f[1] * weight[1] + f[2] * weight[2] + f[3] * weight[3];
  }
};

/// About `step` around a figure of this value.
DifferenceScheme difference_scheme(double step, double value, bool may_be_negative);
/// Over what the step is nearly straight in.
DifferenceScheme difference_scheme(const StepParameter& parameter, const Model& model,
                                   const SimulationOptions& options);

}  // namespace counterpoint
