// Inertial scales of unexplained forces, which change with the parameters of the model.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"

namespace counterpoint::estimation {

/// Scales (nv): for floating links the mass of the tree [kg] and the trace of its bodies'
/// rotational inertia [kg m^2]; 1 elsewhere. Without them, a lighter body would lower every
/// residual.
VectorX force_scales(const Model& model);

/// Derivatives (nv x parameters) of log(scales); scales: those of `model`.
MatrixX force_scale_slopes(const std::vector<StepParameter>& parameters, const Model& model,
                           const VectorX& scales);

}  // namespace counterpoint::estimation
