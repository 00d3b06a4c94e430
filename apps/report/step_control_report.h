// Options of step control in commands, and its part of their reports.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "report.h"

namespace counterpoint::apps {

/// Applies `--adaptive` (a tolerance [m/s, rad/s], "off", or empty: keep the scene's setting) and
/// `--event-tolerance` [s]. @throws InputError.
void override_step_control(const std::string& adaptive, std::optional<double> event_tolerance,
                           SimulationOptions& options);

/// Counts over the controlled steps of a run.
struct ControlTally {
  long accepted = 0, rejected = 0, evaluations = 0, impacts = 0, missed = 0;
  double shortest = 0.0, longest = 0.0;  ///< step lengths of accepted steps [s]
  double worst_missed = 0.0;             ///< largest error over tolerance among the missed steps

  void add(const ControlledReport& step);
};

/// Returns the entry `step_control` of the report (docs/reference/json-reports.md).
Json step_control_report(const StepControlOptions& control, const ControlTally& tally,
                         const Simulator& simulator);
/// Returns the tally as one line of text.
std::string step_control_text(const ControlTally& tally);

}  // namespace counterpoint::apps
