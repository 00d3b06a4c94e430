// Tables of effects, which a scene calls for, why, and what each costs; and of the phases of a
// step.
#pragma once

#include <vector>

#include "counterpoint/engine/step.h"
#include "report.h"

namespace counterpoint::apps {

/// Prints the table and adds "effects" to the report (docs/reference/json-reports.md).
void report_effects(const std::vector<EffectUse>& uses, Report& report);

/// Prints how much of a step's time each phase takes, by timers in the steps of a short run, and
/// adds "phases" to the report; nothing if such a step fails. Takes about half a second.
void report_phases(const Scene& scene, Report& report);

/// Prints microseconds a step as effects are added one by one, on the steps of a short run with all
/// of them, and adds "costs" to the report.
void report_costs(const Scene& scene, const std::vector<EffectUse>& uses, Report& report);

}  // namespace counterpoint::apps
