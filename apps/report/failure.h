// Messages of a failed step, the same in every command.
#pragma once

#include <string>

#include "counterpoint/engine/step.h"
#include "report.h"

namespace counterpoint::apps {

/// Why: "diverged: 'cube.vx' moves mass at ... m/s; max_speed is ... m/s; forces given drive it
/// ...".
std::string why_failed(const Model& model, const StepReport& report);
/// "step 12 at 0.024 s: " and why.
std::string failure_message(const Model& model, const FailedStep& failed);
/// Under `message` and `failure` (docs/reference/json-reports.md).
void add_failure(const Model& model, const FailedStep& failed, Json& out);
/// Ends a command with it: into the report, which is written, and on the error stream.
void report_failure(const Model& model, const FailedStep& failed, Report& report);

}  // namespace counterpoint::apps
