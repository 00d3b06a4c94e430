// Kinematics, dynamics and energies: one function per algorithm, as in the engine.
#include "objects/data_handle.h"

namespace counterpoint::python {
namespace {

void kinematics(const ModelPtr& model, const DataPtr& data, const Array& q, const py::object& v) {
  const auto qs = vector(q, model->model.nq(), "q");
  const Array given = v.is_none() ? Array() : Array(v);
  const bool moving = !v.is_none();
  if (moving) check_shape(given, {model->model.nv()}, "v");
  compute(model, data, [&](Dynamics& d) {
    if (moving) {
      d.set_state(qs, ConstMap(given.data(), d.model().nv()));
    } else {
      d.set_configuration(qs);
    }
  });
}

py::array rnea_of(const ModelPtr& model, const Array& q, const Array& v, const Array& a,
                  const DataPtr& data, const py::object& out) {
  const Model& m = model->model;
  const auto qs = vector(q, m.nq(), "q"), vs = vector(v, m.nv(), "v"), as = vector(a, m.nv(), "a");
  auto tau = output(out, {m.nv()}, "out");
  Eigen::Map<VectorX> result(tau.mutable_data(), m.nv());
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    d.inverse_dynamics(as, result);
  });
  return tau;
}

py::array aba_of(const ModelPtr& model, const Array& q, const Array& v, const Array& tau,
                 const py::object& diagonal, const DataPtr& data, const py::object& out) {
  const Model& m = model->model;
  const auto qs = vector(q, m.nq(), "q"), vs = vector(v, m.nv(), "v"),
             taus = vector(tau, m.nv(), "tau");
  const VectorX added = vector_or(diagonal, VectorX::Zero(m.nv()), "diagonal");
  auto a = output(out, {m.nv()}, "out");
  Eigen::Map<VectorX> result(a.mutable_data(), m.nv());
  int singular = -1;
  bool solved = false;
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    solved = d.forward_dynamics(taus, added, result, &singular);
  });
  if (!solved) throw_singular(m, singular);
  return a;
}

py::array crba_of(const ModelPtr& model, const Array& q, const DataPtr& data,
                  const py::object& out) {
  const Model& m = model->model;
  const auto qs = vector(q, m.nq(), "q");
  auto M = output(out, {m.nv(), m.nv()}, "out");
  // M is symmetric, so a column-major map fills the row-major array correctly.
  Eigen::Map<MatrixX> result(M.mutable_data(), m.nv(), m.nv());
  compute(model, data, [&](Dynamics& d) {
    d.set_configuration(qs);
    d.mass_matrix(result);
  });
  return M;
}

double kinetic(const ModelPtr& model, const Array& q, const Array& v, const DataPtr& data) {
  const auto qs = vector(q, model->model.nq(), "q"), vs = vector(v, model->model.nv(), "v");
  double energy = 0.0;
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    energy = d.kinetic_energy();
  });
  return energy;
}

double potential(const ModelPtr& model, const Array& q, const DataPtr& data) {
  const auto qs = vector(q, model->model.nq(), "q");
  double energy = 0.0;
  compute(model, data, [&](Dynamics& d) {
    d.set_configuration(qs);
    energy = d.potential_energy();
  });
  return energy;
}

py::array momentum(const ModelPtr& model, const Array& q, const Array& v, const DataPtr& data) {
  const auto qs = vector(q, model->model.nq(), "q"), vs = vector(v, model->model.nv(), "v");
  Force total;
  compute(model, data, [&](Dynamics& d) {
    d.set_state(qs, vs);
    total = d.momentum();
  });
  VectorX out(6);
  out << total.torque, total.force;
  return copy(out);
}

py::array integrate(const ModelPtr& model, const Array& q, const Array& v, double h) {
  const Model& m = model->model;
  VectorX next(m.nq());
  integrate_configuration(m, vector(q, m.nq(), "q"), vector(v, m.nv(), "v"), h, next);
  return copy(next);
}

py::array difference(const ModelPtr& model, const Array& from, const Array& to) {
  const Model& m = model->model;
  VectorX v(m.nv());
  configuration_difference(m, vector(from, m.nq(), "q_from"), vector(to, m.nq(), "q_to"), v);
  return copy(v);
}

void bind_data(py::module_& m) {
  py::class_<DataHandle, DataPtr>(m, "Data", R"(
A model's dynamics at a state: pass it to many calls, so that none allocates. Where links are and how
they move: pose, jacobian, frame_motion.

Parameters
----------
model : Model
)")
      .def(py::init<ModelPtr>(), py::arg("model"))
      .def(
          "pose",
          [](const DataPtr& d, const std::string& frame) {
            return d->dynamics.frame_pose(check_frame(*d->model, frame));
          },
          py::arg("frame"), "X_WF of the frame of a link, after compute_kinematics.")
      .def(
          "jacobian",
          [](const DataPtr& d, const std::string& frame) {
            MatrixX J;
            d->dynamics.frame_jacobian(check_frame(*d->model, frame), J);
            return copy_matrix(J);
          },
          py::arg("frame"),
          "J of the frame of a link, after compute_kinematics, shape (6, nv): angular velocity and "
          "velocity of its origin in world axes are J v; J' times torque and force there is their "
          "generalized force.")
      .def("__repr__", [](const DataHandle&) { return "<Data>"; });
}

}  // namespace

constexpr const char* kComputeKinematicsDoc = R"(
Fills data with poses and, with v, velocities of all bodies.

Parameters
----------
model : Model
data : Data
q : array_like, shape (nq,)
    Quaternions must be of unit length.
v : array_like, shape (nv,), optional
    [m/s, rad/s]
)";

constexpr const char* kRneaDoc = R"(
Joint forces that give an acceleration: tau = M(q) a - n(q, v) (Featherstone 2008, table 5.1).

What acts on single coordinates (rotor inertia, damping, dry friction) is not part of it.

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
out : ndarray, shape (nv,), optional

Returns
-------
ndarray, shape (nv,)
    [N, N m]
)";

constexpr const char* kAbaDoc = R"(
Acceleration under joint forces: (M(q) + diag(diagonal)) a = n(q, v) + tau (Featherstone 2008, table 7.1).

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
out : ndarray, shape (nv,), optional

Returns
-------
ndarray, shape (nv,)
    [m/s^2, rad/s^2]
)";

constexpr const char* kCrbaDoc = R"(
Joint-space inertia M(q), without rotor inertia (Featherstone 2008, table 6.2).

Parameters
----------
model : Model
q : array_like, shape (nq,)
data : Data, optional
    Scratch.
out : ndarray, shape (nv, nv), optional

Returns
-------
ndarray, shape (nv, nv)
    [kg, kg m, kg m^2], block diagonal by tree.
)";

void bind_dynamics(py::module_& m) {
  bind_data(m);
  m.def("compute_kinematics", &kinematics, py::arg("model"), py::arg("data"), py::arg("q"),
        py::arg("v") = py::none(), kComputeKinematicsDoc);
  m.def("rnea", &rnea_of, py::arg("model"), py::arg("q"), py::arg("v"), py::arg("a"),
        py::arg("data").none(true) = py::none(), py::kw_only(), py::arg("out") = py::none(),
        kRneaDoc);
  m.def("aba", &aba_of, py::arg("model"), py::arg("q"), py::arg("v"), py::arg("tau"), py::kw_only(),
        py::arg("diagonal") = py::none(), py::arg("data").none(true) = py::none(),
        py::arg("out") = py::none(), kAbaDoc);
  m.def("crba", &crba_of, py::arg("model"), py::arg("q"), py::arg("data").none(true) = py::none(),
        py::kw_only(), py::arg("out") = py::none(), kCrbaDoc);
  m.def(
      "total_mass", [](const ModelHandle& model) { return Dynamics(model.model).total_mass(); },
      py::arg("model"), "Of all bodies that can move [kg].");
  m.def("kinetic_energy", &kinetic, py::arg("model"), py::arg("q"), py::arg("v"),
        py::arg("data").none(true) = py::none(), "[J], rotor inertia (armature) included.");
  m.def("potential_energy", &potential, py::arg("model"), py::arg("q"),
        py::arg("data").none(true) = py::none(),
        "[J], zero where a centre of mass is in the plane through the world's origin across "
        "gravity.");
  m.def("total_momentum", &momentum, py::arg("model"), py::arg("q"), py::arg("v"),
        py::arg("data").none(true) = py::none(),
        "Angular about the world's origin [kg m^2/s], then linear [kg m/s], in the world, shape "
        "(6,).");
  m.def("integrate_configuration", &integrate, py::arg("model"), py::arg("q"), py::arg("v"),
        py::arg("h"), "q (+) h v, shape (nq,): rotations by the exponential map.");
  m.def("configuration_difference", &difference, py::arg("model"), py::arg("q_from"),
        py::arg("q_to"), "v with q_to = q_from (+) v, shape (nv,); rotation angles in [0, pi].");
}

}  // namespace counterpoint::python
