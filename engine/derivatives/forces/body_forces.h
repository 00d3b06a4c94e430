// Wrenches and drag with what they change by.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// Wrenches, which keep their axes, those of W, and go with their points.
void add_wrench_responses(const Model& model, const std::vector<ExternalWrench>& wrenches,
                          const Kinematics& data, ForceResponses& out);

/// Drag (drag.h) at bodies' velocities at the start of a step, data.V, and at its end.
void add_drag_responses(const Model& model, const std::vector<Motion>& V_next, const Kinematics& data,
                        ForceResponses& out);
/// The same at one velocity, data.V: all of it by the velocity at the start.
void add_drag_responses(const Model& model, const Kinematics& data, ForceResponses& out);

/// What taut links lose (taut_links.h) in a step of h [s]; `model` has their inertias.
void add_loss_responses(const Model& model, double h, std::span<const TautLink> links,
                        const Kinematics& data, ForceResponses& out);

}  // namespace counterpoint
