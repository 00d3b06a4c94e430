// Poses in which contacts carry the weight. They depend on the smoothing, with which contacts act
// at a distance.
#pragma once

#include "counterpoint/engine/step.h"

namespace counterpoint::optimization {

/// Returns q (nq) with each tree on a floating joint, or on an unactuated vertical slide, moved
/// along z until contacts carry it at rest, one tree after the other. Trees that no contact can
/// carry stay in place. motors: nv.
VectorX settled(const Model& model, const SimulationOptions& options,
                const std::vector<char>& motors, const VectorX& q, Workspace& workspace);

}  // namespace counterpoint::optimization
