// Runs that are hard by their length: the bundled scenes for hours, the humanoid under random
// forces.
#pragma once

#include <filesystem>
#include <vector>

#include "trial.h"

namespace counterpoint::apps {

/// The length of the full run [s of simulated time]: a day.
inline constexpr double kLongRun = 86400.0;

/// Every scene of `folder` (*.yaml) for an equal part of `seconds`, and the humanoid under random
/// forces for 1e7 steps times seconds / kLongRun; then the mechanisms (mechanisms.h). Checks: every
/// step succeeds and is finite; where no motor drives the scene its energy does not grow; memory
/// does not grow.
std::vector<HardCase> long_cases(const std::filesystem::path& folder, double seconds);

}  // namespace counterpoint::apps
