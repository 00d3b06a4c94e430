// Mechanisms in long runs: the errors of their constraints must not grow from start to end.
#pragma once

#include <string>
#include <vector>

#include "trial.h"

namespace counterpoint::apps {

/// Steps of the short version, and of the full run of a day.
inline constexpr long kMechanismSteps = 20'000, kMechanismStepsADay = 1'000'000;

/// A pendulum, chains, closed linkages, gears and an arm at its limits, `steps` steps each. The
/// first and the last tenth are compared: errors of closures, gears and limits, and energy.
/// `scenes`: path from the folder of the trial to data/scenes, "" or ending in "/".
std::vector<HardCase> mechanism_cases(const std::string& scenes, long steps, bool slow);

}  // namespace counterpoint::apps
