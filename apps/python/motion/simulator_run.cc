// Many steps of a Simulator in one call.
#include <pybind11/stl.h>

#include <algorithm>

#include "objects/exceptions.h"
#include "objects/input_map.h"
#include "objects/interrupts.h"
#include "objects/simulator_handle.h"
#include "objects/trajectories.h"

namespace counterpoint::python {
namespace {

/// Takes steps without recording them.
ReportHandle advance(SimulatorHandle& s, long steps, bool must_succeed) {
  ReportHandle report{s.model, {}};
  SignalWatch watch;
  {
    const Guard::Lock lock(s.guard, kSimulator);
    s.simulator.input() = s.input->value();
    {
      const py::gil_scoped_release release;
      for (long k = 0; k < steps && report.report.succeeded() && !watch.interrupted(); ++k)
        report.report = s.simulator.step();
    }
    s.state->assign(s.simulator.state());
  }
  watch.raise_if_interrupted(py::cast(report));
  if (must_succeed) check(report);
  return report;
}

/// Recorded trajectory of a run, and the report of its last step.
struct Recorded {
  Trajectory trajectory;
  StepReport report;
};

Recorded run_fixed(SimulatorHandle& s, const InputTable& table, const InputMap& map,
                   SignalWatch& watch) {
  Simulator& simulator = s.simulator;
  const Model& model = simulator.model();
  // Limit on the reserved steps: long runs often end early, and all their steps might not fit in
  // memory.
  constexpr py::ssize_t kMostReserved = 10'000;
  MotionRecorder recorder(model, map.columns(),
                          static_cast<size_t>(std::min(table.steps(), kMostReserved)));
  InputMap::Values values = map.start(model);
  StepReport report;
  State before;
  for (py::ssize_t k = 0; k < table.steps() && report.succeeded() && !watch.interrupted(); ++k) {
    if (const double* row = table.row(0, k)) map.apply(model, row, values, simulator.input());
    before = simulator.state();
    report = simulator.step();
    if (report.succeeded())
      recorder.step(before, simulator.input(), simulator.options().time_step, report.softening,
                    simulator.state());
  }
  return {recorder.finish(simulator.state()), report};
}

Recorded run_controlled(SimulatorHandle& s, double duration, const InputMap& map,
                        SignalWatch& watch) {
  Simulator& simulator = s.simulator;
  MotionRecorder recorder(simulator.model(), map.columns(), 0);
  const double end = simulator.state().time + duration;
  ControlledReport step;
  State before;
  while (simulator.state().time < end && step.succeeded() && !watch.interrupted()) {
    before = simulator.state();
    step = simulator.step_controlled(
        next_landing(*simulator.options().step_control, before.time, end));
    if (!step.succeeded()) break;
    recorder.step(before, simulator.input(), 0.5 * step.step, step.first.softening,
                  simulator.middle());
    recorder.step(simulator.middle(), simulator.input(), 0.5 * step.step, step.second.softening,
                  simulator.state());
  }
  return {recorder.finish(simulator.state()), step.second};
}

/// @throws py::value_error for durations that are negative, NaN or too long.
long steps_in(double duration, double time_step) {
  const double steps = std::ceil(duration / time_step - 1e-6);
  if (!(duration >= 0.0) || !(steps < 1e9))
    throw py::value_error("duration: expected 0 s or more, and fewer than 1e9 steps");
  return std::lround(steps);
}

TrajectoryPtr run(SimulatorHandle& s, std::optional<double> duration, std::optional<long> steps,
                  const py::object& inputs, const std::vector<std::string>& columns,
                  bool must_succeed) {
  const InputMap map(*s.model, columns);
  const Guard::Lock lock(s.guard, kSimulator);
  const bool controlled = s.simulator.options().step_control.has_value() && !steps;
  if (controlled && !inputs.is_none())
    throw py::value_error("inputs are by step: with step_control give none, or `steps`");
  if (!s.input->value().wrenches.empty())
    throw py::value_error(
        "wrenches of simulator.input cannot be recorded: give them as columns ('hand.fx') of "
        "inputs");
  const double length = duration.value_or(s.simulator.options().duration);
  if (!steps && !controlled && (duration || inputs.is_none()))
    steps = steps_in(length, s.simulator.options().time_step);
  const InputTable table(inputs, 1, controlled ? 0 : steps.value_or(-1), map);
  auto out = std::make_shared<TrajectoryHandle>();
  out->model = s.model;
  s.simulator.input() = s.input->value();
  SignalWatch watch;
  Recorded motion;
  {
    const py::gil_scoped_release release;
    motion = controlled ? run_controlled(s, length, map, watch) : run_fixed(s, table, map, watch);
  }
  s.state->assign(s.simulator.state());
  out->trajectory = std::move(motion.trajectory);
  const Scene& scene = s.simulator.scene();
  out->scene = std::make_shared<SceneHandle>(
      SceneHandle{scene.name, s.model, scene.q, scene.v, scene.options});
  watch.raise_if_interrupted(py::cast(out));
  if (must_succeed) check(ReportHandle{s.model, motion.report}, py::cast(out));
  return out;
}

constexpr const char* kAdvanceDoc = R"(
Many steps under simulator.input, in one call: faster than a loop in Python where steps are short.

Ctrl-C ends it with KeyboardInterrupt after a step; simulator.state is then where it came to.

Parameters
----------
steps : int
check : bool
    As in step.

Returns
-------
StepReport
    Of the last step, or of the one that failed.
)";

constexpr const char* kRunDoc = R"(
Many steps, recorded; with options.step_control in controlled steps, unless `steps` is given.

Parameters
----------
duration : float, optional
    [s]; default: as many steps as inputs, else options.duration.
steps : int, optional
    In place of the duration.
inputs : array_like, shape (steps, nu), optional
    What acts in each step; default: simulator.input in all.
columns : sequence of str
    What the columns of inputs are: 'elbow.u', 'elbow.target', 'hand.fx' ...; default: the applied
    forces, in the order of model.coordinates.force.
check : bool
    Raise StepError if a step fails; else the trajectory ends where it did.

Returns
-------
Trajectory

Raises
------
StepError
    If a step fails; simulator.state is then the last good one, and the motion until then is the
    exception's attribute `partial`.
KeyboardInterrupt
    Ctrl-C, within a tenth of a second; state and `partial` as above.
)";

}  // namespace

void bind_runs(py::class_<SimulatorHandle, SimulatorPtr>& simulator) {
  simulator.def("advance", &advance, py::arg("steps"), py::arg("check") = true, kAdvanceDoc)
      .def("run", &run, py::arg("duration") = py::none(), py::kw_only(),
           py::arg("steps") = py::none(), py::arg("inputs") = py::none(),
           py::arg("columns") = std::vector<std::string>(), py::arg("check") = true, kRunDoc);
}

}  // namespace counterpoint::python
