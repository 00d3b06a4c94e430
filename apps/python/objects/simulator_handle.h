// A Simulator with the Python objects that show its state and input.
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
  StatePtr state;  ///< shown in Python; simulator.state() is copied to it after every step
  InputPtr input;  ///< copied to simulator.input() before every step
  py::object state_object, input_object;
  /// Result of the last step(); reused if no other reference to it exists.
  py::object report_object;
  Guard guard;
};
using SimulatorPtr = std::shared_ptr<SimulatorHandle>;

/// Name in the messages of Guard.
inline constexpr const char* kSimulator = "Simulator";

/// Binds advance() and run() (simulator_run.cc).
void bind_runs(py::class_<SimulatorHandle, SimulatorPtr>& simulator);

}  // namespace counterpoint::python
