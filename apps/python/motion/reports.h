// Reports of steps and inverses, with the model that their indices refer to.
#pragma once

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "objects/handles.h"

namespace counterpoint::python {

struct ReportHandle {
  ModelPtr model;
  StepReport report;
};

struct ControlledReportHandle {
  ModelPtr model;
  ControlledReport report;
};

/// Never moved once it is a Python object's: its arrays are views.
struct InverseHandle {
  ModelPtr model;
  Inverse inverse;
};

/// "diverged: 'cube.vx' moves ...", as the commands say it.
std::string message_of(const ReportHandle& report);
/// Throws StepError if it failed, with what was computed before.
void check(const ReportHandle& report, const py::object& partial = py::none());

}  // namespace counterpoint::python
