// Exact derivatives of the residuals that identification minimizes, by the parameters that steps
// have closed forms for (engine/derivatives.h).
#pragma once

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// Predictions of what bounces leave out what the parameters make of an impact's displacement within
/// its step (bounce.h).
/// By parameter: its derivative comes from `linearize`. Not of sizes, nor where an impact law
/// predicts.
std::vector<char> exact_parameters(const Experiment& experiment,
                                   const std::vector<Parameter>& parameters, bool by_force);

/// Residuals as objective.h has them, and their derivatives by these parameters; columns of the
/// others are zero. By forward sensitivities of the predictions, or of the inverse. None where
/// contacts take a part of the forces.
std::optional<LinearizedResiduals> linearize(const Experiment& experiment,
                                             const std::vector<Parameter>& parameters,
                                             const VectorX& values, const std::vector<int>& which,
                                             bool by_force);

}  // namespace counterpoint::estimation
