#include "step_control_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "counterpoint/model/text_files.h"

namespace counterpoint::apps {

void override_step_control(const std::string& adaptive, std::optional<double> event_tolerance,
                           SimulationOptions& options) {
  if (adaptive == "off") {
    options.step_control.reset();
  } else if (!adaptive.empty()) {
    if (!options.step_control) options.step_control.emplace();
    const std::optional<double> tolerance = parse_number(adaptive);
    options.step_control->tolerance = tolerance.value_or(0.0);
    if (!tolerance || !step_control_flaw(*options.step_control).empty()) {
      throw InputError(
          fmt::format("--adaptive {}: expected a positive number [m/s, rad/s], or off", adaptive));
    }
  }
  if (!event_tolerance) return;
  if (!options.step_control) {
    throw InputError(
        "--event-tolerance: without step control steps are of one length; add --adaptive");
  }
  StepControlOptions& control = *options.step_control;
  control.event_tolerance = *event_tolerance;
  control.min_step = std::min(control.min_step, *event_tolerance);
  if (const std::string flaw = step_control_flaw(control); !flaw.empty())
    throw InputError(fmt::format("--event-tolerance {}: {}", *event_tolerance, flaw));
}

void ControlTally::add(const ControlledReport& step) {
  rejected += step.rejected;
  evaluations += step.evaluations;
  if (!step.succeeded()) return;
  shortest = accepted == 0 ? step.step : std::min(shortest, step.step);
  longest = std::max(longest, step.step);
  ++accepted;
  impacts += step.impact;
  missed += step.missed;
  if (step.missed) worst_missed = std::max(worst_missed, step.error);
}

Json step_control_report(const StepControlOptions& control, const ControlTally& tally,
                         const Simulator& simulator) {
  Json out;
  out["tolerance"] = control.tolerance;
  out["relative_tolerance"] = control.relative_tolerance;
  out["event_tolerance_s"] = control.event_tolerance;
  out["accepted"] = tally.accepted;
  out["rejected"] = tally.rejected;
  out["evaluations"] = tally.evaluations;
  out["impacts"] = tally.impacts;
  out["missed"] = tally.missed;
  out["missed_error_max"] = tally.worst_missed;
  out["step_min_s"] = tally.shortest;
  out["step_max_s"] = tally.longest;
  out["next_step_s"] = simulator.next_step();
  return out;
}

std::string step_control_text(const ControlTally& tally) {
  std::string text = fmt::format(
      "{} controlled steps of {:.3g} to {:.3g} s, {} lengths rejected, {} impacts landed on",
      tally.accepted, tally.shortest, tally.longest, tally.rejected, tally.impacts);
  if (tally.missed > 0) {
    text += fmt::format(
        "; {} steps of the shortest length missed the tolerance, the worst by a factor of {:.3g}",
        tally.missed, tally.worst_missed);
  }
  return text;
}

}  // namespace counterpoint::apps
