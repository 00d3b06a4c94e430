// Energy of a whole scene, as reports give it.
#pragma once

#include "counterpoint/engine/state.h"

namespace counterpoint::apps {

/// Kinetic and potential energy, that of springs included [J].
double total_energy(const Model& model, const State& state);

}  // namespace counterpoint::apps
