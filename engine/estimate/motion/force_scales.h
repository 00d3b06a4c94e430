// Scales of unexplained forces, as figures of the model change.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"

namespace counterpoint::estimation {

/// nv: of free links the mass of the tree [kg], and its bodies' rotational inertia [kg m^2]; 1 for
/// all others. Without it a lighter body would explain everything.
VectorX force_scales(const Model& model);

/// nv x parameters: derivatives of the logarithms of `scales`, which are the model's.
MatrixX force_scale_slopes(const std::vector<StepParameter>& parameters, const Model& model,
                           const VectorX& scales);

}  // namespace counterpoint::estimation
