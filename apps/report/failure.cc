#include "failure.h"

#include <fmt/format.h>

#include <cmath>

namespace counterpoint::apps {

std::string why_failed(const Model& model, const StepReport& report) {
  const FaultText text = describe(model, report.fault);
  std::string why = contact::status_name(report.status);
  if (!text.reason.empty()) why += fmt::format(": {}; {}", text.reason, text.advice);
  if (report.fault.kind == FaultKind::kUnsolved) {
    why += fmt::format(" (relative residual {:.2g} after {} Newton iterations)", report.residual,
                       report.newton_iterations);
  }
  return why;
}

std::string failure_message(const Model& model, const FailedStep& failed) {
  return fmt::format("step {} at {:.6g} s: {}", failed.step, failed.time,
                     why_failed(model, failed.report));
}

void add_failure(const Model& model, const FailedStep& failed, Json& out) {
  const StepReport& report = failed.report;
  const FaultText text = describe(model, report.fault);
  out["message"] = failure_message(model, failed);
  Json& failure = out["failure"];
  failure["step"] = failed.step;
  failure["time_s"] = failed.time;
  failure["step_status"] = contact::status_name(report.status);
  failure["fault"] = fault_kind_name(report.fault.kind);
  failure["element"] = text.element;
  failure["value"] = std::isfinite(report.fault.value) ? Json(report.fault.value) : Json(nullptr);
  failure["reason"] = text.reason;
  failure["advice"] = text.advice;
  failure["residual"] = report.residual;
  failure["newton_iterations"] = report.newton_iterations;
}

void report_failure(const Model& model, const FailedStep& failed, Report& report) {
  add_failure(model, failed, report.json());
  report.write();
  fmt::print(stderr, "error: {}\n", failure_message(model, failed));
}

}  // namespace counterpoint::apps
