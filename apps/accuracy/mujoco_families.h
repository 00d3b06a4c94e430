// MuJoCo on the same scenes and pieces.
#pragma once

#include <vector>

#include "families.h"

namespace counterpoint::apps::accuracy {

/// Curves over the time steps [s]: as it comes, with its Runge-Kutta method, and set up for
/// accuracy (peers/mujoco.h). With constraints each is measured against its own fine run: its
/// contact model has another limit. Without MuJoCo the item is left out.
void add_mujoco(const Scene& scene, const std::vector<double>& time_steps, bool constrained,
                Families& out);

}  // namespace counterpoint::apps::accuracy
