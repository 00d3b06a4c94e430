// One step forward and its inverse, as pure functions of their arguments.
#include "counterpoint/engine/step.h"

#include "objects/workspace.h"
#include "reports.h"

namespace counterpoint::python {
namespace {

/// @throws py::value_error if the state belongs to another model.
void check_state(const ModelPtr& model, const StateHandle& state, const char* name) {
  if (state.value().q.size() != model->model.nq() || state.value().v.size() != model->model.nv())
    throw py::value_error(std::string(name) + ": it is of another model");
}

py::tuple step_forward_of(const ModelPtr& model, const SimulationOptions& options,
                          const StateHandle& state, const InputPtr& input,
                          const contact::Settings& settings, const WorkspacePtr& given,
                          const StatePtr& next) {
  check_state(model, state, "state");
  const WorkspacePtr w = given_or_new(given, model, "workspace");
  const Guard::Lock lock(w->guard, "Workspace");
  StatePtr out = next;
  if (out) {
    check_state(model, *out, "next");
    out->check_writable();
  } else {
    out = std::make_shared<StateHandle>(model->coordinates, state.value(), false);
  }
  w->state = state.value();
  w->set_input(input);
  ReportHandle report{model, {}};
  {
    const SimulationOptions own = options;
    const contact::Settings own_settings = settings;
    const py::gil_scoped_release release;
    report.report =
        step_forward(model->model, own, own_settings, w->state, w->input, w->workspace, w->next);
  }
  if (report.report.succeeded()) out->assign(w->next);
  return py::make_tuple(out, std::move(report));
}

std::shared_ptr<InverseHandle> step_inverse_of(const ModelPtr& model,
                                               const SimulationOptions& options, const Array& q,
                                               const Array& v, const Array& v_next,
                                               const py::object& q_next, const InputPtr& known,
                                               const WorkspacePtr& given) {
  const Model& m = model->model;
  const WorkspacePtr w = given_or_new(given, model, "workspace");
  const Guard::Lock lock(w->guard, "Workspace");
  w->set_motion(q, v, q_next, v_next, known);
  auto out = std::make_shared<InverseHandle>();
  out->model = model;
  const SimulationOptions own = options;
  const py::gil_scoped_release release;
  step_inverse(m, own, w->q, w->v, w->q_next, w->v_next, w->input, w->workspace, out->inverse);
  return out;
}

}  // namespace

constexpr const char* kWorkspaceDoc = R"(
Scratch of one thread for one model: pass it to many steps, so that none allocates.

Parameters
----------
model : Model
)";

constexpr const char* kStepForwardDoc = R"(
Advances a state by options.time_step. A pure function: equal arguments give equal bits.

Parameters
----------
model : Model
options : SimulationOptions
state : State
input : Input, optional
    Default: nothing acts, servos as the model says.
settings : contact.Settings
workspace : Workspace, optional
    Scratch; without it one is made for this call, which costs more than the step.
next : State, optional
    Where the result goes; may be `state`. Default: a new one.

Returns
-------
next : State
    If the step failed, as it was.
report : StepReport
    Nothing is raised for a step that fails: see report.succeeded.

Raises
------
InputError
    Where the time step is not positive.
)";

constexpr const char* kStepInverseDoc = R"(
Recovers what was applied between (q, v) and v_next: the exact inverse of step_forward.

Parameters
----------
model : Model
options : SimulationOptions
    As the step had them.
q : array_like, shape (nq,)
    At the start of the step.
v : array_like, shape (nv,)
    At the start [m/s, rad/s].
v_next : array_like, shape (nv,)
    At the end [m/s, rad/s].
q_next : array_like, shape (nq,), optional
    At the end; implicit_midpoint needs it where there are constraints.
known : Input, optional
    What is known of the input: wrenches, servo targets, softening; its applied force is not used.
workspace : Workspace, optional

Returns
-------
Inverse

Raises
------
InputError
    For an integrator without inverse.
)";

void bind_step(py::module_& m) {
  py::class_<WorkspaceHandle, WorkspacePtr>(m, "Workspace", kWorkspaceDoc)
      .def(py::init<ModelPtr>(), py::arg("model"))
      .def("__repr__", [](const WorkspaceHandle&) { return "<Workspace>"; });
  m.def("step_forward", &step_forward_of, py::arg("model"), py::arg("options"), py::arg("state"),
        py::arg("input").none(true) = py::none(), py::kw_only(),
        py::arg("settings") = contact::Settings(), py::arg("workspace").none(true) = py::none(),
        py::arg("next").none(true) = py::none(), kStepForwardDoc);
  m.def("step_inverse", &step_inverse_of, py::arg("model"), py::arg("options"), py::arg("q"),
        py::arg("v"), py::arg("v_next"), py::kw_only(), py::arg("q_next") = py::none(),
        py::arg("known").none(true) = py::none(), py::arg("workspace").none(true) = py::none(),
        kStepInverseDoc);
}

}  // namespace counterpoint::python
