// Parameters of identification as parameters of steps, which steps can differentiate in closed form
// (engine/derivatives.h).
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// Returns the kind of the step parameter; none for parameters that steps do not differentiate.
std::optional<StepParameterKind> step_kind(ParameterKind kind);

/// Returns the inertia of a body at these values of all parameters, which act in their order on
/// that in `model`.
SpatialInertia inertia_at(const std::vector<Parameter>& parameters, const VectorX& values, int body,
                          const Model& model);

/// Returns parameter number k in the form that steps differentiate, at these values of all
/// parameters; model: that of the scene, before they act. The parameter must have a step_kind.
StepParameter step_parameter(const std::vector<Parameter>& parameters, std::size_t k,
                             const VectorX& values, const Model& model);

}  // namespace counterpoint::estimation
