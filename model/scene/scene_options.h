// Options of a simulation in scene files (docs/reference/scene-format.md).
#pragma once

#include "counterpoint/model/scene.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Keys of a scene that hold options.
inline constexpr const char* kOptionKeys[] = {
    "time_step",   "integrator",      "duration", "max_speed",    "closing_time",
    "step_budget", "velocity_forces", "effects",  "step_control", "contact"};

/// Sets the options whose keys `in` has; collects their faults.
void read_options(const YamlValue& in, Faults& faults, SimulationOptions& out);

}  // namespace counterpoint
