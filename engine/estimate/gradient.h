// Exact derivatives of the residuals that identification minimizes, by the parameters that steps
// have closed forms for (engine/derivatives.h).
#pragma once

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// A parameter as a step knows it; none of sizes. value: the parameter's in `model`.
std::optional<StepParameter> step_parameter(const Parameter& parameter, double value,
                                            const Model& model);

/// By parameter: its derivative comes from `linearize`. Not of sizes, nor where an impact law
/// predicts. Predictions of what bounces leave out what the parameters make of an impact's
/// displacement within its step (engine/constraints/bounce.h).
std::vector<char> exact_parameters(const Experiment& experiment,
                                   const std::vector<Parameter>& parameters, bool by_force);

/// Residuals as force_residuals and prediction_residuals give them, and their derivatives by these
/// parameters; columns of the others are zero. By forward sensitivities of the predictions, or of
/// the inverse. None where contacts take a part of the forces.
std::optional<LinearizedResiduals> linearize(const Experiment& experiment,
                                             const std::vector<Parameter>& parameters,
                                             const VectorX& values, const std::vector<int>& which,
                                             bool by_force);

}  // namespace counterpoint::estimation
