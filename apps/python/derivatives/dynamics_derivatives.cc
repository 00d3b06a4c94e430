// Derivatives of inverse and forward dynamics, and the regressor of the inertial parameters.
#include "objects/data_handle.h"
#include "objects/properties.h"

namespace counterpoint::python {
namespace {

/// Constant once a Python object holds them, since their arrays are views.
using OfRnea = std::shared_ptr<RneaDerivatives>;
using OfAba = std::shared_ptr<AbaDerivatives>;

OfRnea rnea_derivatives(const ModelPtr& model, const Array& q, const Array& v, const Array& a,
                        const DataPtr& data) {
  const Model& m = model->model;
  const auto qs = vector(q, m.nq(), "q"), vs = vector(v, m.nv(), "v"), as = vector(a, m.nv(), "a");
  auto out = std::make_shared<RneaDerivatives>();
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    d.inverse_dynamics_derivatives(as, *out);
  });
  return out;
}

OfAba aba_derivatives(const ModelPtr& model, const Array& q, const Array& v, const Array& tau,
                      const py::object& diagonal, const DataPtr& data) {
  const Model& m = model->model;
  const auto qs = vector(q, m.nq(), "q"), vs = vector(v, m.nv(), "v"),
             taus = vector(tau, m.nv(), "tau");
  const VectorX added = vector_or(diagonal, VectorX::Zero(m.nv()), "diagonal");
  auto out = std::make_shared<AbaDerivatives>();
  int singular = -1;
  bool solved = false;
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    solved = d.forward_dynamics_derivatives(taus, added, *out, &singular);
  });
  if (!solved) throw_singular(m, singular);
  return out;
}

py::array inertia_regressor(const ModelPtr& model, const Array& q, const Array& v, const Array& a,
                            const DataPtr& data, const py::object& out) {
  const Model& m = model->model;
  const auto qs = vector(q, m.nq(), "q"), vs = vector(v, m.nv(), "v"), as = vector(a, m.nv(), "a");
  auto Y = output(out, {m.nv(), 10 * (m.num_bodies() - 1)}, "out");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor> result(Y.mutable_data(), Y.shape(0), Y.shape(1));
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    MatrixX columns;
    d.inertia_regressor(as, columns);
    result = columns;
  });
  return Y;
}

constexpr const char* kRneaDerivativesDoc = R"(
Derivatives of rnea: of tau = M(q) a - n(q, v), in closed form by one backward pass.

A displacement dq of a configuration means q (+) dq, as integrate_configuration with h = 1 moves it.

Parameters
----------
model : Model
q : array_like, shape (nq,)
v : array_like, shape (nv,)
    [m/s, rad/s]
a : array_like, shape (nv,)
    [m/s^2, rad/s^2]
data : Data, optional
    Scratch.

Returns
-------
RneaDerivatives
)";

constexpr const char* kAbaDerivativesDoc = R"(
Derivatives of aba: of a = inv(M(q) + diag(diagonal)) (n(q, v) + tau).

Those of rnea at that acceleration, times -inv(M + diag(diagonal)).

Parameters
----------
model : Model
q : array_like, shape (nq,)
v : array_like, shape (nv,)
    [m/s, rad/s]
tau : array_like, shape (nv,)
    [N, N m]
diagonal : array_like, shape (nv,), optional
    What acts on single coordinates: model.armature, say [kg, kg m^2]; default: nothing.
data : Data, optional
    Scratch.

Returns
-------
AbaDerivatives
)";

constexpr const char* kRegressorDoc = R"(
Y with rnea(model, q, v, a) = Y inertial_parameters(model) (Atkeson, An, Hollerbach 1986).

Parameters
----------
model : Model
q : array_like, shape (nq,)
v : array_like, shape (nv,)
    [m/s, rad/s]
a : array_like, shape (nv,)
    [m/s^2, rad/s^2]
data : Data, optional
    Scratch.
out : ndarray, shape (nv, 10 (num_bodies - 1)), optional

Returns
-------
ndarray, shape (nv, 10 (num_bodies - 1))
)";

}  // namespace

void bind_dynamics_derivatives(py::module_& m) {
  using R = RneaDerivatives;
  py::class_<R, OfRnea>(m, "RneaDerivatives", "Of joint forces (rows), nv x nv each.")
      .def_property_readonly("dq", view_of(&R::dq),
                             "By a displacement at q [N/m, N/rad, N m/m, N m/rad], shape (nv, nv).")
      .def_property_readonly("dv", view_of(&R::dv), "By v [N s/m, ...], shape (nv, nv).")
      .def_property_readonly("da", view_of(&R::da),
                             "By a: M(q) [kg, kg m, kg m^2], shape (nv, nv).")
      .def("__repr__",
           [](const R& d) { return py::str("<RneaDerivatives: nv {}>").format(d.dq.rows()); });
  using A = AbaDerivatives;
  py::class_<A, OfAba>(m, "AbaDerivatives", "Of accelerations (rows), nv x nv each.")
      .def_property_readonly("dq", view_of(&A::dq), "By a displacement at q, shape (nv, nv).")
      .def_property_readonly("dv", view_of(&A::dv), "By v [1/s, ...], shape (nv, nv).")
      .def_property_readonly("dtau", view_of(&A::dtau),
                             "By tau: inv(M + diag(diagonal)) [1/kg, ...], shape (nv, nv).")
      .def("__repr__",
           [](const A& d) { return py::str("<AbaDerivatives: nv {}>").format(d.dq.rows()); });
  m.def("rnea_derivatives", &rnea_derivatives, py::arg("model"), py::arg("q"), py::arg("v"),
        py::arg("a"), py::arg("data").none(true) = py::none(), kRneaDerivativesDoc);
  m.def("aba_derivatives", &aba_derivatives, py::arg("model"), py::arg("q"), py::arg("v"),
        py::arg("tau"), py::kw_only(), py::arg("diagonal") = py::none(),
        py::arg("data").none(true) = py::none(), kAbaDerivativesDoc);
  m.def(
      "inertial_parameters",
      [](const ModelHandle& model) { return copy(inertial_parameters(model.model)); },
      py::arg("model"),
      "Ten a body, the world left out: mass [kg], first moments (x, y, z) [kg m], second moments "
      "xx, "
      "xy, yy, xz, yz, zz about the body's origin [kg m^2], shape (10 (num_bodies - 1),).");
  m.def("inertia_regressor", &inertia_regressor, py::arg("model"), py::arg("q"), py::arg("v"),
        py::arg("a"), py::arg("data").none(true) = py::none(), py::kw_only(),
        py::arg("out") = py::none(), kRegressorDoc);
}

}  // namespace counterpoint::python
