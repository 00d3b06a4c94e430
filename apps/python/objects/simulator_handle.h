// A Simulator with what Python sees of it.
#pragma once

#include "counterpoint/engine/simulator.h"
#include "handles.h"
#include "motion/reports.h"

namespace counterpoint::python {

struct SimulatorHandle {
  explicit SimulatorHandle(const SceneHandle& scene)
      : model(scene.model),
        simulator(scene.scene()),
        state(std::make_shared<StateHandle>(model->coordinates, simulator.state(), true)),
        input(std::make_shared<InputHandle>(model)),
        state_object(py::cast(state)),
        input_object(py::cast(input)) {}

  ModelPtr model;
  Simulator simulator;
  StatePtr state;  ///< what Python sees of simulator.state(): copied after every step
  InputPtr input;  ///< copied into simulator.input() before
  py::object state_object, input_object;
  /// What the last step() gave; taken again once nobody else holds it.
  py::object report_object;
  Guard guard;
};
using SimulatorPtr = std::shared_ptr<SimulatorHandle>;

/// How Guard calls it.
inline constexpr const char* kSimulator = "Simulator";

/// advance() and run() (simulator_run.cc).
void bind_runs(py::class_<SimulatorHandle, SimulatorPtr>& simulator);

}  // namespace counterpoint::python
