// Simulator: a scene with its state, step and inverse.
#include <pybind11/stl.h>

#include "objects/fast.h"
#include "objects/simulator_handle.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

py::object take_step(SimulatorHandle& s, bool must_succeed) {
  if (!s.report_object || Py_REFCNT(s.report_object.ptr()) > 1)
    s.report_object = py::cast(ReportHandle{s.model, {}});
  const py::object object = s.report_object;
  ReportHandle& report = held_by<ReportHandle>(object.ptr());
  {
    const Guard::Lock lock(s.guard, kSimulator);
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

/// step(check=True) with the fastest calling convention of CPython.
PyObject* fast_step(PyObject* self, PyObject* const* values, Py_ssize_t count, PyObject* names) {
  return translated([&]() -> PyObject* {
    const Py_ssize_t named = names == nullptr ? 0 : PyTuple_GET_SIZE(names);
    if (count + named > 1 ||
        (named == 1 && PyUnicode_CompareWithASCIIString(PyTuple_GET_ITEM(names, 0), "check") != 0))
      throw py::type_error("step: expected no argument but `check`");
    const int must_succeed = count + named == 1 ? PyObject_IsTrue(values[0]) : 1;
    if (must_succeed < 0) throw py::error_already_set();
    return take_step(held_by<SimulatorHandle>(self), must_succeed == 1).release().ptr();
  });
}

/// Replaces the method step() defined by pybind11 with fast_step.
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
    const Guard::Lock lock(s.guard, kSimulator);
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

void set_state(SimulatorHandle& s, const StateHandle& state) {
  const Guard::Lock lock(s.guard, kSimulator);
  s.state->assign(state.value());  // checks the sizes
  s.simulator.set_state(state.value());
}

std::shared_ptr<InverseHandle> inverse_of(SimulatorHandle& s, const Array& q, const Array& v,
                                          const Array& v_next, const py::object& q_next) {
  const Model& m = s.model->model;
  const Guard::Lock lock(s.guard, kSimulator);
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

/// Returns a copy, since the simulator's own result lasts only until its next inverse.
std::shared_ptr<InverseHandle> last_forces(SimulatorHandle& s) {
  const Guard::Lock lock(s.guard, kSimulator);
  auto out = std::make_shared<InverseHandle>();
  out->model = s.model;
  const py::gil_scoped_release release;
  out->inverse = s.simulator.last_forces();
  return out;
}

FrameMotion frame(SimulatorHandle& s, const std::string& name) {
  check_frame(*s.model, name);
  const Guard::Lock lock(s.guard, kSimulator);
  return s.simulator.frame(name);
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

void bind_steps(py::class_<SimulatorHandle, SimulatorPtr>& simulator) {
  simulator.def("step", &take_step, py::arg("check") = true, kStepDoc)
      .def("step_controlled", &step_controlled, py::arg("until"), py::arg("check") = true,
           kStepControlledDoc);
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

constexpr const char* kLastForcesDoc = R"(
The forces of the last step: contacts with place, frame and force, closures, servos, applied forces.

Of a controlled step they are those of its second half.

Returns
-------
Inverse

Raises
------
InputError
    Where there was no step since construction, `reset` or the assignment of a state.
)";

void bind_calls(py::class_<SimulatorHandle, SimulatorPtr>& simulator) {
  using S = SimulatorHandle;
  simulator
      .def(
          "reset",
          [](S& s) {
            const Guard::Lock lock(s.guard, kSimulator);
            s.simulator.reset();
            s.state->assign(s.simulator.state());
          },
          "Back to the scene's start; the input stays.")
      .def("inverse", &inverse_of, py::arg("q"), py::arg("v"), py::arg("v_next"),
           py::arg("q_next") = py::none(), kInverseDoc)
      .def("last_forces", &last_forces, kLastForcesDoc)
      .def(
          "frame", &frame, py::arg("name"),
          "FrameMotion of the frame of a link, at simulator.state: pose and velocity in the world.")
      .def(
          "effect_counts",
          [](const S& s) {
            Typed<py::dict, "Dict[str, int]"> out;
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
      .def_readonly("model", &S::model, "Model.")
      .def_property_readonly(
          "options", [](S& s) -> SimulationOptions& { return s.simulator.options(); },
          py::return_value_policy::reference_internal, "SimulationOptions, live.")
      .def_property_readonly(
          "settings", [](S& s) -> contact::Settings& { return s.simulator.settings(); },
          py::return_value_policy::reference_internal, "contact.Settings, live.")
      .def(
          "set_threads", [](S& s, int count) { s.simulator.set_threads(count); }, py::arg("count"),
          "Threads that share each step, to the same bits; 1 at first. Pays for many robots or "
          "bodies that do not touch.")
      .def_property(
          "state", [](const S& s) { return s.state; }, &set_state,
          "The State: its arrays show every step, read-only. Assign a State to set it.")
      .def_property(
          "input", [](const S& s) { return s.input; },
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
  bind_runs(simulator);
  make_step_fast(simulator);
  make_fast<S>(simulator, "q", [](S& s) { return new_reference(s.state->q); });
  make_fast<S>(simulator, "v", [](S& s) { return new_reference(s.state->v); });
  make_fast<S>(simulator, "state", [](S& s) { return new_reference(s.state_object); });
  make_fast<S>(simulator, "input", [](S& s) { return new_reference(s.input_object); });
  make_fast<S>(simulator, "time", [](S& s) { return PyFloat_FromDouble(s.state->value().time); });
}

}  // namespace counterpoint::python
