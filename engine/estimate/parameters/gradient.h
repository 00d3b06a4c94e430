// Exact derivatives of the residuals of identification with respect to the parameters that steps
// can differentiate in closed form (engine/derivatives.h).
#pragma once

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// Marks the parameters whose derivatives `linearize` computes. None for maps of impacts, or an
/// integrator other than semi-implicit Euler; sizes never. Derivatives of predictions that bounce
/// omit the effect of the parameters on the impact's displacement within its step
/// (engine/constraints/bounce.h).
std::vector<char> exact_parameters(const Experiment& experiment,
                                   const std::vector<Parameter>& parameters, bool by_force);

/// Computes the residuals of force_residuals or prediction_residuals and their derivatives, by
/// forward sensitivities of the predictions or by derivatives of inverse dynamics. Columns of
/// parameters without exact derivatives are zero. Returns nullopt if contacts carry part of the
/// forces.
std::optional<LinearizedResiduals> linearize(const Experiment& experiment,
                                             const std::vector<Parameter>& parameters,
                                             const VectorX& values, const std::vector<int>& which,
                                             bool by_force);

}  // namespace counterpoint::estimation
