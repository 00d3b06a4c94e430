// Runs that are hard by their length: the bundled scenes for hours, the humanoid under random
// forces.
#pragma once

#include <filesystem>
#include <vector>

#include "trial.h"

namespace counterpoint::apps {

/// Simulated time of the full run [s]: a day.
inline constexpr double kLongRun = 86400.0;

/// Runs every scene of `folder` (*.yaml) for an equal part of `seconds`, the humanoid under random
/// forces for 1e7 steps times seconds / kLongRun, then the mechanisms (mechanisms.h). Checks: every
/// step succeeds and is finite; the energy does not grow where no motor drives the scene; memory
/// does not grow.
std::vector<HardCase> long_cases(const std::filesystem::path& folder, double seconds);

}  // namespace counterpoint::apps
