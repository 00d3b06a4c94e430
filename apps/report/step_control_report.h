// Step control in commands: its options, and its part of reports.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "report.h"

namespace counterpoint::apps {

/// `--adaptive` (a tolerance [m/s, rad/s], "off", or empty: as the scene says) and
/// `--event-tolerance` [s]. @throws InputError.
void override_step_control(const std::string& adaptive, std::optional<double> event_tolerance,
                           SimulationOptions& options);

/// What is counted over the controlled steps of a run.
struct ControlTally {
  long accepted = 0, rejected = 0, evaluations = 0, impacts = 0, missed = 0;
  double shortest = 0.0, longest = 0.0;  ///< [s]
  double worst_missed = 0.0;             ///< error over the tolerance

  void add(const ControlledReport& step);
};

/// Under `step_control` (docs/reference/json-reports.md).
Json step_control_report(const StepControlOptions& control, const ControlTally& tally,
                         const Simulator& simulator);
/// The same in a line.
std::string step_control_text(const ControlTally& tally);

}  // namespace counterpoint::apps
