// A pose that stands: with smoothing, contacts carry a weight from a distance, so that where a
// robot stands depends on it.
#pragma once

#include "counterpoint/engine/step.h"

namespace counterpoint::optimization {

/// q (nq) with every floating tree raised or lowered along z, one after the other, until contacts
/// carry it at rest; trees that nothing below would carry stay.
VectorX settled(const Model& model, const SimulationOptions& options, const VectorX& q,
                Workspace& workspace);

}  // namespace counterpoint::optimization
