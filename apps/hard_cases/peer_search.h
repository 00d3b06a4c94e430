// The settings of MuJoCo that suit a case best, found by running it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "trial.h"

namespace counterpoint::apps {

/// The settings that differ from MuJoCo's defaults, such as "elliptic, impratio 100"; or
/// "defaults".
std::string words(const peers::MujocoSettings& settings);

/// The settings that a search tries at first, from cheap to dear.
std::vector<peers::MujocoSettings> coarse_settings();
/// The changes of one setting each that it tries then, on the best settings so far.
using SettingChange = void (*)(peers::MujocoSettings&);
std::vector<SettingChange> finer_changes();

/// True if `a` is better than `b`: it reached the end, then passes more checks, then misses their
/// bounds by fewer orders of magnitude, summed over the checks.
bool better(const Run& a, const Run& b);

/// Runs all coarse settings, then the finer changes, keeping each that makes the run better. Ends
/// early once all checks pass, after `seconds` of wall time, or if the engine lacks what the case
/// needs. Returns the best run; among equals the first.
Run search_settings(const std::function<Run(const peers::MujocoSettings&)>& run, double seconds);

}  // namespace counterpoint::apps
