// MuJoCo on the same scenes and pieces.
#pragma once

#include <vector>

#include "families.h"

namespace counterpoint::apps::accuracy {

/// Adds curves over the time steps [s]: MuJoCo's defaults, its Runge-Kutta method, and its most
/// accurate settings (peers/mujoco_settings.h). With constraints each is measured against its own
/// fine run, because its contact model converges to another limit. Without MuJoCo the item is left
/// out.
void add_mujoco(const Scene& scene, const std::vector<double>& time_steps, bool constrained,
                Families& out);

}  // namespace counterpoint::apps::accuracy
