// External wrenches, drag and losses of taut links, with their derivatives.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// Adds external wrenches, which keep their world axes and act at body-fixed points.
void add_wrench_responses(const Model& model, const std::vector<ExternalWrench>& wrenches,
                          const Kinematics& data, ForceResponses& out);

/// Adds drag (drag.h) at the bodies' velocities at the start of a step, data.V, and at its end.
void add_drag_responses(const Model& model, const std::vector<Motion>& V_next,
                        const Kinematics& data, ForceResponses& out);
/// Adds drag with both velocities equal to data.V; all of the response is by the velocity at the
/// start.
void add_drag_responses(const Model& model, const Kinematics& data, ForceResponses& out);

/// Adds the torques that taut links lose (taut_links.h) in a step of h [s]; `model` has the
/// increased inertias.
void add_loss_responses(const Model& model, double h, std::span<const TautLink> links,
                        const Kinematics& data, ForceResponses& out);

}  // namespace counterpoint
