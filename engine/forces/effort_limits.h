// What motors can give: the applied force of a joint is clamped to +-E in each coordinate.
//
// Of actuated joints without a servo; the row of a servo includes the limit (servos.h). The inverse
// recovers the clamped force.
#pragma once

#include "counterpoint/model/effect.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Clamps the applied forces `tau` (nv) [N, N m]. `effects` says whether servos are on.
void limit_applied_forces(const Model& model, EffectSet effects, VectorOut tau);

}  // namespace counterpoint
