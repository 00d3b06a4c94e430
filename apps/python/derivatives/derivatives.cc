// Derivatives of a step and of its inverse.
#include "motion/reports.h"
#include "objects/derivative_method.h"
#include "objects/properties.h"
#include "objects/workspace.h"

namespace counterpoint::python {
namespace {

/// Constant once a Python object holds them, since their arrays are views.
using Inverted = std::shared_ptr<InverseDerivatives>;
using Advanced = std::shared_ptr<ForwardDerivatives>;

py::tuple of_inverse(const ModelPtr& model, const SimulationOptions& options, const Array& q,
                     const Array& v, const Array& v_next, const py::object& q_next,
                     const InputPtr& known, const WorkspacePtr& given, const std::string& method,
                     double difference_step) {
  const DerivativeMethod how = method_from(method);
  const WorkspacePtr w = given_or_new(given, model, "workspace");
  const Guard::Lock lock(w->guard, "Workspace");
  w->set_motion(q, v, q_next, v_next, known);
  auto inverse = std::make_shared<InverseHandle>();
  inverse->model = model;
  auto out = std::make_shared<InverseDerivatives>();
  {
    const SimulationOptions own = options;
    const py::gil_scoped_release release;
    step_inverse_derivatives(model->model, own, w->q, w->v, w->q_next, w->v_next, w->input,
                             w->workspace, inverse->inverse, *out, how, difference_step);
  }
  return py::make_tuple(inverse, out);
}

Advanced of_forward(const ModelPtr& model, const SimulationOptions& options, const Array& q,
                    const Array& v, const Array& v_next, const py::object& q_next,
                    const InputPtr& known, const WorkspacePtr& given, const std::string& method) {
  const DerivativeMethod how = method_from(method);
  const WorkspacePtr w = given_or_new(given, model, "workspace");
  const Guard::Lock lock(w->guard, "Workspace");
  w->set_motion(q, v, q_next, v_next, known);
  auto out = std::make_shared<ForwardDerivatives>();
  Inverse inverse;
  InverseDerivatives of_the_inverse;
  const SimulationOptions own = options;
  const py::gil_scoped_release release;
  step_forward_derivatives(model->model, own, w->q, w->v, w->q_next, w->v_next, w->input,
                           w->workspace, inverse, of_the_inverse, *out, how);
  return out;
}

constexpr const char* kStepInverseDerivativesDoc = R"(
What a step from (q, v) to v_next recovers, as step_inverse does, and its derivatives.

A displacement dq of a configuration means q (+) dq, as integrate_configuration with h = 1 moves it.

Parameters
----------
model : Model
options : SimulationOptions
    As the step had them: semi_implicit_euler or implicit_midpoint.
q : array_like, shape (nq,)
    At the start of the step.
v, v_next : array_like, shape (nv,)
    At the start and the end [m/s, rad/s].
q_next : array_like, shape (nq,), optional
    At the end: of implicit_midpoint with constraints, else not looked at.
known : Input, optional
    Wrenches, servo targets, softening; held.
workspace : Workspace, optional
method : {'analytic', 'central_differences', 'extrapolated'}
    In closed form, or by differences of the whole step.
difference_step : float
    Of configurations [m, rad]; 0: as fits the contacts' smoothing. Looked at by differences only.

Returns
-------
inverse : Inverse
derivatives : InverseDerivatives
    NaN where inverse.fault says that forces are not known.
)";

constexpr const char* kStepForwardDerivativesDoc = R"(
Derivatives of the step from (q, v) that led to v_next: by one linear solve from those of the inverse.

Parameters
----------
model : Model
options : SimulationOptions
q : array_like, shape (nq,)
    At the start of the step.
v, v_next : array_like, shape (nv,)
    At the start and the end [m/s, rad/s].
q_next : array_like, shape (nq,), optional
    At the end: of implicit_midpoint with constraints, else not looked at.
known : Input, optional
    What acted; its applied force is not looked at.
workspace : Workspace, optional
method : {'analytic', 'central_differences', 'extrapolated'}

Returns
-------
ForwardDerivatives
    NaN where the step has none: an applied force that changes nothing.
)";

}  // namespace

void bind_derivatives(py::module_& m) {
  using I = InverseDerivatives;
  py::class_<I, Inverted>(m, "InverseDerivatives",
                          "Of the applied force that step_inverse recovers (rows), by what it was "
                          "recovered from (columns), nv x nv.")
      .def_property_readonly("dq", view_of(&I::dq),
                             "By a displacement at q [N/m, N/rad, N m/m, N m/rad], shape (nv, nv).")
      .def_property_readonly("dv", view_of(&I::dv), "By v [N s/m, ...], shape (nv, nv).")
      .def_property_readonly("dv_next", view_of(&I::dv_next),
                             "By v_next [N s/m, ...], shape (nv, nv).")
      .def_readonly("by_differences", &I::by_differences,
                    "Something acts that has no closed form: extrapolated differences.")
      .def("__repr__",
           [](const I& d) { return py::str("<InverseDerivatives: nv {}>").format(d.dv.rows()); });
  using F = ForwardDerivatives;
  py::class_<F, Advanced>(m, "ForwardDerivatives",
                          "Of the state at the end of a step (rows), by that at its start and by "
                          "the applied force (columns), nv x nv.")
      .def_property_readonly("dv_dq", view_of(&F::dv_dq), "Shape (nv, nv).")
      .def_property_readonly("dv_dv", view_of(&F::dv_dv), "Shape (nv, nv).")
      .def_property_readonly("dv_du", view_of(&F::dv_du), "Shape (nv, nv).")
      .def_property_readonly("dq_dq", view_of(&F::dq_dq),
                             "Displacements at the end, shape (nv, nv).")
      .def_property_readonly("dq_dv", view_of(&F::dq_dv),
                             "Displacements at the end, shape (nv, nv).")
      .def_property_readonly("dq_du", view_of(&F::dq_du),
                             "Displacements at the end, shape (nv, nv).")
      .def("__repr__", [](const F& d) {
        return py::str("<ForwardDerivatives: nv {}>").format(d.dv_dv.rows());
      });
  m.def("step_inverse_derivatives", &of_inverse, py::arg("model"), py::arg("options"), py::arg("q"),
        py::arg("v"), py::arg("v_next"), py::kw_only(), py::arg("q_next") = py::none(),
        py::arg("known").none(true) = py::none(), py::arg("workspace").none(true) = py::none(),
        py::arg("method") = "analytic", py::arg("difference_step") = 0.0,
        kStepInverseDerivativesDoc);
  m.def("step_forward_derivatives", &of_forward, py::arg("model"), py::arg("options"), py::arg("q"),
        py::arg("v"), py::arg("v_next"), py::kw_only(), py::arg("q_next") = py::none(),
        py::arg("known").none(true) = py::none(), py::arg("workspace").none(true) = py::none(),
        py::arg("method") = "analytic", kStepForwardDerivativesDoc);
}

}  // namespace counterpoint::python
