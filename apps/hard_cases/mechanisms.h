// Mechanisms stepped for long: the errors of their constraints must not grow from start to end.
#pragma once

#include <string>
#include <vector>

#include "trial.h"

namespace counterpoint::apps {

/// Steps of the short version, and of the long one for a day.
inline constexpr long kMechanismSteps = 20'000, kMechanismStepsADay = 1'000'000;

/// A pendulum, chains, linkages that close, gears, an arm on its limits: each for `steps` steps.
/// Compared are the first and the last tenth: how far closures, gears and limits are off, energy.
/// `scenes`: from the folder of the trial to data/scenes, "" or ending in "/".
std::vector<HardCase> mechanism_cases(const std::string& scenes, long steps, bool slow);

}  // namespace counterpoint::apps
