// Tables of the effects of a scene (which are on, why, and their cost) and of the phases of a step.
#pragma once

#include <vector>

#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"
#include "report.h"

namespace counterpoint::apps {

/// Prints the table of effects and adds "effects" to the report (docs/reference/json-reports.md).
void report_effects(const std::vector<EffectUse>& uses, Report& report);

/// Prints the time of each phase of a step, measured by timers in a short run, and adds "phases" to
/// the report; does nothing if a step of that run fails. Takes about half a second.
void report_phases(const Scene& scene, Report& report);

/// Prints the time of a step [us] as effects are added one by one, measured on the states of a
/// short run with that set of effects, and adds "costs" to the report.
void report_costs(const Scene& scene, const std::vector<EffectUse>& uses, Report& report);

}  // namespace counterpoint::apps
