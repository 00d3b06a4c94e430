// Difference schemes for one parameter of a model.
#pragma once

#include <array>

#include "counterpoint/engine/derivatives.h"

namespace counterpoint {

/// df/dp = sum of weight[i] f(p + at[i]): central differences extrapolated from two steps; or
/// one-sided differences of third order, if the parameter must not be negative and is (nearly)
/// zero.
struct DifferenceScheme {
  std::array<double, 4> at, weight;

  template <class T>
  T operator()(const std::array<T, 4>& f) const {
    return f[0] * weight[0] + f[1] * weight[1] + f[2] * weight[2] + f[3] * weight[3];
  }
};

/// Returns the scheme with this step for a parameter of this value.
DifferenceScheme difference_scheme(double step, double value, bool may_be_negative);
/// Returns the scheme with a step over which the time step is nearly linear in the parameter.
DifferenceScheme difference_scheme(const StepParameter& parameter, const Model& model,
                                   const SimulationOptions& options);

}  // namespace counterpoint
