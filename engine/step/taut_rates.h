// Turning rates of taut links (taut_links.h) from the forces of a finished step.
#pragma once

#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Finds the rates at which the forces of the step to `next` turn its taut links, into
/// ws.taut_links. Call after a successful step.
void find_taut_rates(const StepArguments& step, const State& next, Workspace::Impl& ws);

}  // namespace counterpoint
