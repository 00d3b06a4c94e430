// States and names of coordinates.
#include "counterpoint/engine/state.h"

#include <pybind11/stl.h>

#include <bit>
#include <cstdint>

#include "objects/fast.h"
#include "objects/handles.h"
#include "objects/properties.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

/// The memory of copy.deepcopy.
using Memo = Typed<py::dict, "Dict[int, Any]">;

/// Columns of a remembered force: kind, a, b, at (3), force (3), torque (3), as in state files.
constexpr int kMemoryColumns = 12;

py::array memory_array(const std::vector<RememberedForce>& memory) {
  py::array_t<double> out(Shape1{static_cast<py::ssize_t>(memory.size()), kMemoryColumns});
  double* row = out.mutable_data();
  for (const RememberedForce& r : memory) {
    const double head[] = {static_cast<double>(r.kind), static_cast<double>(r.a),
                           static_cast<double>(r.b)};
    row = std::copy(std::begin(head), std::end(head), row);
    for (const Vector3* v : {&r.at, &r.force, &r.torque}) row = std::copy_n(v->data(), 3, row);
  }
  return out;
}

std::vector<RememberedForce> memory_from(const Array& array) {
  const auto rows = matrix(array, -1, kMemoryColumns, "memory");
  std::vector<RememberedForce> memory;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const auto row = rows.row(i);
    if (!(row[0] >= 0.0 && row[0] <= 3.0 && row[0] == std::floor(row[0])) ||
        !(row[1] >= 0.0 && row[1] < 1e9) || !(row[2] >= 0.0 && row[2] < 1e9))
      throw py::value_error("memory: row " + std::to_string(i) + " names no constraint");
    memory.push_back({static_cast<RememberedForce::Kind>(static_cast<int>(row[0])),
                      static_cast<int>(row[1]), static_cast<int>(row[2]), row.segment<3>(3),
                      row.segment<3>(6), row.segment<3>(9)});
  }
  return memory;
}

CoordinatesPtr coordinates_from(const py::object& what) {
  if (py::isinstance<ModelHandle>(what)) return what.cast<ModelPtr>()->coordinates;
  return what.cast<CoordinatesPtr>();
}

StatePtr make_state(const py::object& model, const py::object& q, const py::object& v, double time,
                    const py::object& memory, const py::object& z) {
  CoordinatesPtr names;
  if (py::isinstance<ModelHandle>(model) || py::isinstance<Coordinates>(model))
    names = coordinates_from(model);
  else
    throw py::type_error("State: expected a Model first");
  const auto nq = static_cast<Eigen::Index>(names->names.q.size());
  const auto nv = static_cast<Eigen::Index>(names->names.v.size());
  State state;
  state.time = time;
  if (!q.is_none())
    state.q = vector(Array(q), nq, "q");
  else if (py::isinstance<ModelHandle>(model))
    state.q = model.cast<ModelPtr>()->model.default_q();
  else
    throw py::type_error("State: q is missing");
  state.v = vector_or(v, VectorX::Zero(nv), "v");
  if (!memory.is_none()) state.memory = memory_from(Array(memory));
  const auto nz = static_cast<Eigen::Index>(names->names.z.size());
  if (!z.is_none() && py::len(z) > 0)
    state.z = vector(Array(z), nz, "z");
  else if (py::isinstance<ModelHandle>(model))
    state.z = model.cast<ModelPtr>()->model.default_z();
  return std::make_shared<StateHandle>(std::move(names), std::move(state), false);
}

StatePtr copy_of(const StateHandle& s) {
  return std::make_shared<StateHandle>(s.coordinates, s.value(), false);
}

/// Compares to the last bit, remembered forces included.
bool equal(const StateHandle& a, const StateHandle& b) {
  const auto same = [](const VectorX& x, const VectorX& y) {
    return x.size() == y.size() &&
           (x.size() == 0 ||
            std::memcmp(x.data(), y.data(), sizeof(double) * static_cast<size_t>(x.size())) == 0);
  };
  return std::bit_cast<std::uint64_t>(a.value().time) ==
             std::bit_cast<std::uint64_t>(b.value().time) &&
         same(a.value().q, b.value().q) && same(a.value().v, b.value().v) &&
         same(a.value().z, b.value().z) && a.value().memory == b.value().memory;
}

std::string state_repr(const StateHandle& s) {
  const State& x = s.value();
  std::string text = py::str("State(time={:.6g}").format(x.time).cast<std::string>();
  constexpr size_t kMost = 12;
  size_t shown = 0;
  const auto add = [&](const std::vector<std::string>& names, const VectorX& values) {
    for (size_t i = 0; i < names.size() && shown < kMost; ++i, ++shown)
      text += ", " + py::str("{}={:.6g}")
                         .format(names[i], values[static_cast<Eigen::Index>(i)])
                         .cast<std::string>();
  };
  add(s.coordinates->names.q, x.q);
  add(s.coordinates->names.v, x.v);
  const size_t all = s.coordinates->names.q.size() + s.coordinates->names.v.size();
  return text + (shown < all ? ", ... " + std::to_string(all - shown) + " more)" : ")");
}

template <class Class>
void bind_state_access(Class& state) {
  state
      .def(
          "__getitem__", [](const StateHandle& s, const std::string& name) { return s.at(name); },
          py::arg("name"), "Value of a coordinate: state['cube.z'], state['elbow.v'].")
      .def(
          "__setitem__",
          [](StateHandle& s, const std::string& name, double x) {
            s.check_writable();
            s.at(name) = x;
          },
          py::arg("name"), py::arg("value"))
      .def(
          "keys",
          [](const StateHandle& s) {
            std::vector<std::string> all = s.coordinates->names.q;
            all.insert(all.end(), s.coordinates->names.v.begin(), s.coordinates->names.v.end());
            return all;
          },
          "Names of all coordinates, q first.")
      .def("_ipython_key_completions_", [](const py::object& s) { return s.attr("keys")(); })
      .def("copy", &copy_of, "A copy of its own, writable.")
      .def("__copy__", &copy_of)
      .def(
          "__deepcopy__", [](const StateHandle& s, const Memo&) { return copy_of(s); },
          py::arg("memo"))
      .def(
          "assign",
          [](StateHandle& s, const StateHandle& other) {
            s.check_writable();
            s.assign(other.value());
          },
          py::arg("other"), "Takes all values of another state of the same model.")
      .def("__eq__", &equal, "Equal to the last bit, memory included.")
      .def_property_readonly(
          "taut_links",
          [](const StateHandle& s) {
            std::vector<TautLink> links;
            find_taut_links(s.value(), links);
            return tuples_of(links);
          },
          "Light links under tension that the step to this state turned more slowly: (body, "
          "factor, kept) each; Input.taut_links of its inverse.")
      .def_property_readonly(
          "hash", [](const StateHandle& s) { return state_hash(s.value()); },
          "64-bit hash of the bits of time, q, v and z, as in trajectories.")
      .def("__repr__", &state_repr)
      .def("__reduce__", [](const py::object& self) {
        const auto& s = self.cast<const StateHandle&>();
        return py::make_tuple(
            self.get_type(),
            py::make_tuple(s.coordinates, copy(s.value().q), copy(s.value().v), s.value().time,
                           memory_array(s.value().memory), copy(s.value().z)));
      });
}

}  // namespace

void bind_coordinates(py::module_& m) {
  py::class_<Coordinates, CoordinatesPtr>(m, "Coordinates", R"(
Names of the coordinates of a model, in the order of q, v and applied forces.)")
      .def_property_readonly("q", through(&Coordinates::names, &CoordinateNames::q),
                             "'elbow.q', 'cube.x', 'cube.qw' ..., nq of them.")
      .def_property_readonly("v", through(&Coordinates::names, &CoordinateNames::v),
                             "'elbow.v', 'cube.vx', 'cube.wx' ..., nv of them.")
      .def_property_readonly("force", through(&Coordinates::names, &CoordinateNames::force),
                             "'elbow.u', 'cube.fx', 'cube.tx' ..., nv of them.")
      .def_property_readonly("z", through(&Coordinates::names, &CoordinateNames::z),
                             "'motor.current', 'muscle.activation' ..., nz of them.")
      .def("__repr__",
           [](const Coordinates& c) {
             return py::str("<Coordinates: nq {}, nv {}>")
                 .format(c.names.q.size(), c.names.v.size());
           })
      .def(py::pickle(
          [](const Coordinates& c) {
            return py::make_tuple(c.names.q, c.names.v, c.names.force, c.names.z);
          },
          [](const py::tuple& t) {
            using Names = std::vector<std::string>;
            return std::make_shared<Coordinates>(CoordinateNames{
                t[0].cast<Names>(), t[1].cast<Names>(), t[2].cast<Names>(), t[3].cast<Names>()});
          }));
}

void bind_inputs(py::module_& m);  // input.cc

constexpr const char* kStateDoc = R"(
The whole truth about a moment: equal states step to equal bits.

Parameters
----------
model : Model or Coordinates
q : array_like, shape (nq,), optional
    Coordinates; default: the model's.
v : array_like, shape (nv,), optional
    Velocities [m/s, rad/s]; default: zero.
time : float
    [s]
memory : array_like, shape (n, 12), optional
    Forces of the last step, which the next one starts from.
z : array_like, shape (nz,), optional
    Internal states of actuators and switched closures; default: the model's.
)";

void bind_state(py::module_& m) {
  py::class_<StateHandle, StatePtr> state(m, "State", kStateDoc);
  state
      .def(py::init(&make_state), py::arg("model"), py::arg("q") = py::none(),
           py::arg("v") = py::none(), py::arg("time") = 0.0, py::arg("memory") = py::none(),
           py::arg("z") = py::none())
      .def_property(
          "time", [](const StateHandle& s) { return s.value().time; },
          [](StateHandle& s, double t) {
            s.check_writable();
            s.set_time(t);
          },
          "[s]")
      .def_property(
          "q", [](const StateHandle& s) { return s.q; },
          [](StateHandle& s, const Array& q) {
            s.check_writable();
            State next = s.value();
            next.q = vector(q, next.q.size(), "q");
            s.assign(next);
          },
          "Coordinates [m, rad, quaternions], shape (nq,), a view; of a simulator read-only.")
      .def_property(
          "v", [](const StateHandle& s) { return s.v; },
          [](StateHandle& s, const Array& v) {
            s.check_writable();
            State next = s.value();
            next.v = vector(v, next.v.size(), "v");
            s.assign(next);
          },
          "Velocities [m/s, rad/s], shape (nv,), a view; of a simulator read-only.")
      .def_property(
          "z", [](const StateHandle& s) { return copy(s.value().z); },
          [](StateHandle& s, const Array& z) {
            s.check_writable();
            State next = s.value();
            next.z = vector(z, static_cast<Eigen::Index>(s.coordinates->names.z.size()), "z");
            s.assign(next);
          },
          "Internal states of actuators and switched closures, shape (nz,), a copy; named by "
          "coordinates.z.")
      .def_property(
          "memory", [](const StateHandle& s) { return memory_array(s.value().memory); },
          [](StateHandle& s, const Array& a) {
            s.check_writable();
            s.set_memory(memory_from(a));
          },
          "Forces of the last step, shape (n, 12), a copy: kind, a, b, place, force, torque.")
      .def_readonly("coordinates", &StateHandle::coordinates, "Names of the coordinates.");
  bind_state_access(state);
  using S = StateHandle;
  make_fast<S>(state, "q", [](S& s) { return new_reference(s.q); });
  make_fast<S>(state, "v", [](S& s) { return new_reference(s.v); });
  make_fast<S>(state, "time", [](S& s) { return PyFloat_FromDouble(s.value().time); });
  bind_inputs(m);
}

}  // namespace counterpoint::python
