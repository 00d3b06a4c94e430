// The table of effects: which a scene calls for, why, and what each costs.
#pragma once

#include <vector>

#include "counterpoint/engine/effects.h"
#include "report.h"

namespace counterpoint::apps {

/// Prints the table and adds "effects" to the report (docs/reference/json-reports.md). The share of an effect
/// is measured: the scene runs for a moment, then its steps are taken again with and without the
/// effect, in turn. Takes about a second.
void report_effects(const Scene& scene, const std::vector<EffectUse>& uses, Report& report);

/// Prints microseconds a step as effects are added one by one, on the steps of a short run with all
/// of them, and adds "costs" to the report.
void report_costs(const Scene& scene, const std::vector<EffectUse>& uses, Report& report);

}  // namespace counterpoint::apps
