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

/// Not moved while a Python object holds it, since its arrays are views.
struct InverseHandle {
  ModelPtr model;
  Inverse inverse;
};

/// Message as in the commands: "diverged: 'cube.vx' moves ...".
std::string message_of(const ReportHandle& report);
/// Throws StepError if the step failed; `partial` holds the results before it.
void check(const ReportHandle& report, const py::object& partial = py::none());

}  // namespace counterpoint::python
