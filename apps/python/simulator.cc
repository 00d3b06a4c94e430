// The few lines most users need: a scene, its state, step, inverse.
#include "counterpoint/engine/simulator.h"

#include <pybind11/stl.h>

#include "fast.h"
#include "input_map.h"
#include "reports.h"
#include "trajectories.h"

namespace counterpoint::python {
namespace {

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
constexpr const char* kWhat = "Simulator";

py::object step(SimulatorHandle& s, bool must_succeed) {
  if (!s.report_object || Py_REFCNT(s.report_object.ptr()) > 1)
    s.report_object = py::cast(ReportHandle{s.model, {}});
  const py::object object = s.report_object;
  ReportHandle& report = object_of<ReportHandle>(object.ptr());
  {
    const Guard::Lock lock(s.guard, kWhat);
    s.simulator.input() = s.input->value();
    {
      const py::gil_scoped_release release;
      report.report = s.simulator.step();
    }
    s.state->assign(s.simulator.state());
  }
  if (must_succeed) check(report);
  return object;
}

/// step(check=True) as CPython calls it fastest.
PyObject* fast_step(PyObject* self, PyObject* const* values, Py_ssize_t count, PyObject* names) {
  return translated([&]() -> PyObject* {
    const Py_ssize_t named = names == nullptr ? 0 : PyTuple_GET_SIZE(names);
    if (count + named > 1 ||
        (named == 1 && PyUnicode_CompareWithASCIIString(PyTuple_GET_ITEM(names, 0), "check") != 0))
      throw py::type_error("step: expected no argument but `check`");
    const int must_succeed = count + named == 1 ? PyObject_IsTrue(values[0]) : 1;
    if (must_succeed < 0) throw py::error_already_set();
    return step(object_of<SimulatorHandle>(self), must_succeed == 1).release().ptr();
  });
}

/// Puts it in place of what pybind11 made of step().
void make_step_fast(const py::handle& type) {
  static const std::string text = py::str(type.attr("step").attr("__doc__")).cast<std::string>();
  static PyMethodDef definition{
      "step", reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&fast_step)),
      METH_FASTCALL | METH_KEYWORDS, text.c_str()};
  type.attr("step") = py::reinterpret_steal<py::object>(
      PyDescr_NewMethod(reinterpret_cast<PyTypeObject*>(type.ptr()), &definition));
}

ControlledReportHandle step_controlled(SimulatorHandle& s, double until, bool must_succeed) {
  ControlledReportHandle report{s.model, {}};
  {
    const Guard::Lock lock(s.guard, kWhat);
    s.simulator.input() = s.input->value();
    {
      const py::gil_scoped_release release;
      report.report = s.simulator.step_controlled(until);
    }
    s.state->assign(s.simulator.state());
  }
  if (must_succeed) check(ReportHandle{s.model, report.report.second});
  return report;
}

/// Steps without a record.
ReportHandle advance(SimulatorHandle& s, long steps, bool must_succeed) {
  ReportHandle report{s.model, {}};
  {
    const Guard::Lock lock(s.guard, kWhat);
    s.simulator.input() = s.input->value();
    {
      const py::gil_scoped_release release;
      for (long k = 0; k < steps && report.report.succeeded(); ++k)
        report.report = s.simulator.step();
    }
    s.state->assign(s.simulator.state());
  }
  if (must_succeed) check(report);
  return report;
}

void set_state(SimulatorHandle& s, const StateHandle& state) {
  const Guard::Lock lock(s.guard, kWhat);
  s.state->assign(state.value());  // checks the sizes
  s.simulator.set_state(state.value());
}

/// What a run records.
struct Motion_ {
  Trajectory trajectory;
  StepReport report;
};

Motion_ run_fixed(SimulatorHandle& s, const InputTable& table, const InputMap& map) {
  Simulator& simulator = s.simulator;
  const Model& model = simulator.model();
  MotionRecorder recorder(model, map.columns(), static_cast<size_t>(table.steps()));
  InputMap::Values values = map.start(model);
  StepReport report;
  State before;
  for (py::ssize_t k = 0; k < table.steps() && report.succeeded(); ++k) {
    if (const double* row = table.row(0, k)) map.apply(model, row, values, simulator.input());
    before = simulator.state();
    report = simulator.step();
    if (report.succeeded())
      recorder.step(before, simulator.input(), simulator.options().time_step, report.softening);
  }
  return {recorder.finish(simulator.state()), report};
}

Motion_ run_controlled(SimulatorHandle& s, double duration, const InputMap& map) {
  Simulator& simulator = s.simulator;
  MotionRecorder recorder(simulator.model(), map.columns(), 0);
  const double end = simulator.state().time + duration;
  ControlledReport step;
  State before;
  while (simulator.state().time < end && step.succeeded()) {
    before = simulator.state();
    step = simulator.step_controlled(
        next_landing(*simulator.options().step_control, before.time, end));
    if (!step.succeeded()) break;
    recorder.step(before, simulator.input(), 0.5 * step.step, step.first.softening);
    recorder.step(simulator.middle(), simulator.input(), 0.5 * step.step, step.second.softening);
  }
  return {recorder.finish(simulator.state()), step.second};
}

/// @throws py::value_error for durations that are none, or too long.
long steps_in(double duration, double time_step) {
  const double steps = std::ceil(duration / time_step - 1e-6);
  if (!(duration >= 0.0) || !(steps < 1e9))
    throw py::value_error("duration: expected 0 s or more, and fewer than 1e9 steps");
  return std::lround(steps);
}

TrajectoryPtr run(SimulatorHandle& s, std::optional<double> duration, std::optional<long> steps,
                  const py::object& inputs, const std::vector<std::string>& columns) {
  const InputMap map(*s.model, columns);
  const Guard::Lock lock(s.guard, kWhat);
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
  Motion_ motion;
  {
    const py::gil_scoped_release release;
    motion = controlled ? run_controlled(s, length, map) : run_fixed(s, table, map);
  }
  s.state->assign(s.simulator.state());
  out->trajectory = std::move(motion.trajectory);
  const Scene& scene = s.simulator.scene();
  out->scene = std::make_shared<SceneHandle>(
      SceneHandle{scene.name, s.model, scene.q, scene.v, scene.options});
  check(ReportHandle{s.model, motion.report});
  return out;
}

std::shared_ptr<InverseHandle> inverse(SimulatorHandle& s, const Array& q, const Array& v,
                                       const Array& v_next, const py::object& q_next) {
  const Model& m = s.model->model;
  const Guard::Lock lock(s.guard, kWhat);
  const VectorX q0 = vector(q, m.nq(), "q"), v0 = vector(v, m.nv(), "v"),
                v1 = vector(v_next, m.nv(), "v_next");
  VectorX q1;
  if (!q_next.is_none()) q1 = vector(Array(q_next), m.nq(), "q_next");
  s.simulator.input() = s.input->value();
  auto out = std::make_shared<InverseHandle>();
  out->model = s.model;
  const py::gil_scoped_release release;
  out->inverse = s.simulator.inverse(q0, v0, q1, v1);
  return out;
}

constexpr const char* kStepDoc = R"(
One step.

Parameters
----------
check : bool
    Raise StepError if it fails; else the report says so. The state is then left as it was.

Returns
-------
StepReport
)";

constexpr const char* kStepControlledDoc = R"(
Two steps, as long as options.step_control allows.

Parameters
----------
until : float
    Not beyond this time [s].
check : bool
    As in step.

Returns
-------
ControlledReport
)";

constexpr const char* kAdvanceDoc = R"(
Many steps under simulator.input, in one call: faster than a loop in Python where steps are short.

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

Returns
-------
Trajectory

Raises
------
StepError
    If a step fails; simulator.state is then the last good one.
)";

void bind_steps(py::class_<SimulatorHandle, SimulatorPtr>& simulator) {
  simulator.def("step", &step, py::arg("check") = true, kStepDoc)
      .def("step_controlled", &step_controlled, py::arg("until"), py::arg("check") = true,
           kStepControlledDoc)
      .def("advance", &advance, py::arg("steps"), py::arg("check") = true, kAdvanceDoc)
      .def("run", &run, py::arg("duration") = py::none(), py::kw_only(),
           py::arg("steps") = py::none(), py::arg("inputs") = py::none(),
           py::arg("columns") = std::vector<std::string>(), kRunDoc);
}

}  // namespace

constexpr const char* kSimulatorDoc = R"(
A scene, its state, step, inverse. One thread at a time; several side by side.

Parameters
----------
scene : Scene
    Copied: what changes later in it has no effect here.
)";

constexpr const char* kInverseDoc = R"(
The forces between (q, v) and v_next, beside wrenches and servo targets of simulator.input.

Parameters
----------
q : array_like, shape (nq,)
v, v_next : array_like, shape (nv,)
    At the start and the end of the step [m/s, rad/s].
q_next : array_like, shape (nq,), optional
    At the end; implicit_midpoint needs it where there are constraints.

Returns
-------
Inverse
)";

void bind_calls(py::class_<SimulatorHandle, SimulatorPtr>& simulator) {
  using S = SimulatorHandle;
  simulator
      .def(
          "reset",
          [](S& s) {
            const Guard::Lock lock(s.guard, kWhat);
            s.simulator.reset();
            s.state->assign(s.simulator.state());
          },
          "Back to the scene's start; the input stays.")
      .def("inverse", &inverse, py::arg("q"), py::arg("v"), py::arg("v_next"),
           py::arg("q_next") = py::none(), kInverseDoc)
      .def(
          "effect_counts",
          [](const S& s) {
            py::dict out;
            for (int i = 0; i < kNumEffects; ++i)
              out[effect_name(static_cast<Effect>(i))] =
                  s.simulator.effect_counts()[static_cast<Effect>(i)];
            return out;
          },
          "How often the code of each effect has run, by name.")
      .def("__repr__", [](const S& s) {
        return py::str("<Simulator of '{}' at {:.6g} s>")
            .format(s.simulator.scene().name, s.state->value().time);
      });
}

void bind_simulator(py::module_& m) {
  using S = SimulatorHandle;
  py::class_<S, SimulatorPtr> simulator(m, "Simulator", kSimulatorDoc);
  simulator
      .def(py::init([](const SceneHandle& scene) { return std::make_shared<S>(scene); }),
           py::arg("scene"))
      .def_property_readonly(
          "model", [](const S& s) { return s.model; }, "Model.")
      .def_property_readonly(
          "options", [](S& s) -> SimulationOptions& { return s.simulator.options(); },
          py::return_value_policy::reference_internal, "SimulationOptions, live.")
      .def_property_readonly(
          "settings", [](S& s) -> contact::Settings& { return s.simulator.settings(); },
          py::return_value_policy::reference_internal, "contact.Settings, live.")
      .def_property(
          "state", [](const S& s) { return s.state_object; }, &set_state,
          "The State: its arrays show every step, read-only. Assign a State to set it.")
      .def_property(
          "input", [](const S& s) { return s.input_object; },
          [](S& s, const InputHandle& input) {
            if (input.model != s.model) throw py::value_error("input: it is of another model");
            s.input->assign(input.value());
          },
          "The Input of all steps to come, kept until changed.")
      .def_property_readonly(
          "time", [](const S& s) { return s.state->value().time; }, "[s]")
      .def_property_readonly(
          "q", [](const S& s) { return s.state->q; },
          "state.q, shape (nq,), a view that shows every step, read-only.")
      .def_property_readonly(
          "v", [](const S& s) { return s.state->v; },
          "state.v, shape (nv,), a view that shows every step, read-only.")
      .def_property(
          "next_step", [](const S& s) { return s.simulator.next_step(); },
          [](S& s, double h) { s.simulator.set_next_step(h); },
          "The length that the next controlled step will try [s].");
  bind_calls(simulator);
  bind_steps(simulator);
  make_step_fast(simulator);
  make_fast<S>(simulator, "q", [](S& s) { return new_reference(s.state->q); });
  make_fast<S>(simulator, "v", [](S& s) { return new_reference(s.state->v); });
  make_fast<S>(simulator, "state", [](S& s) { return new_reference(s.state_object); });
  make_fast<S>(simulator, "input", [](S& s) { return new_reference(s.input_object); });
  make_fast<S>(simulator, "time", [](S& s) { return PyFloat_FromDouble(s.state->value().time); });
}

}  // namespace counterpoint::python
