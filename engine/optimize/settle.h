// A pose in which contacts carry the weight. With smoothing they carry it from a distance, so the
// pose depends on the smoothing.
#pragma once

#include "counterpoint/engine/step.h"

namespace counterpoint::optimization {

/// q (nq) with every tree on a floating joint, or on a vertical slide without a motor, raised or
/// lowered along z, one after the other, until contacts carry it at rest; trees that nothing below
/// would carry stay. motors: nv.
VectorX settled(const Model& model, const SimulationOptions& options,
                const std::vector<char>& motors, const VectorX& q, Workspace& workspace);

}  // namespace counterpoint::optimization
