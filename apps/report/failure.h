// Messages of a failed step, the same in every command.
#pragma once

#include <string>

#include "counterpoint/engine/step.h"
#include "report.h"

namespace counterpoint::apps {

/// Reason of the failure: "diverged: 'cube.vx' moves mass at ... m/s; max_speed is ... m/s; forces
/// given drive it ...".
std::string why_failed(const Model& model, const StepReport& report);
/// Returns "step 12 at 0.024 s: " followed by the reason.
std::string failure_message(const Model& model, const FailedStep& failed);
/// Adds `message` and `failure` to a report (docs/reference/json-reports.md).
void add_failure(const Model& model, const FailedStep& failed, Json& out);
/// Reports a failure at the end of a command: adds it to the report, writes the report, and prints
/// the message on standard error.
void report_failure(const Model& model, const FailedStep& failed, Report& report);

}  // namespace counterpoint::apps
