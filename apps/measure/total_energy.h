// Energy of a whole scene, for reports.
#pragma once

#include "counterpoint/engine/state.h"

namespace counterpoint::apps {

/// Kinetic plus potential energy, including springs [J].
double total_energy(const Model& model, const State& state);

}  // namespace counterpoint::apps
