// Inputs applied during a step.
#include <pybind11/stl.h>

#include <limits>

#include "objects/handles.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

void add_wrench(InputHandle& input, const Key& link, const Array& force, const Array& torque,
                const Array& point) {
  const Model& model = input.model->model;
  const int index = index_from(
      link, static_cast<int>(model.frames().size()), "link",
      [&](const std::string& name) { return model.find_frame(name); },
      [&] { return names_of(model.frames()); });
  const Frame& frame = model.frames()[static_cast<size_t>(index)];
  ExternalWrench wrench;
  wrench.body = frame.body;
  wrench.wrench = {vector3(torque, "torque"), vector3(force, "force")};
  wrench.point = frame.X_BF * vector3(point, "point");
  wrench.frame = index;
  input.value().wrenches.push_back(wrench);
}

void set(const py::array& view, const Array& values, const char* name) {
  const auto x = vector(values, view.size(), name);
  std::copy(x.begin(), x.end(), static_cast<double*>(const_cast<void*>(view.data())));
}

}  // namespace

void InputHandle::assign(const Input& other) {
  if (other.applied_force.size() == input_->applied_force.size())
    input_->applied_force = other.applied_force;
  else
    input_->applied_force.setZero();
  if (other.servo_position.size() == input_->servo_position.size())
    input_->servo_position = other.servo_position;
  if (other.servo_velocity.size() == input_->servo_velocity.size())
    input_->servo_velocity = other.servo_velocity;
  if (other.tendon_force.size() == input_->tendon_force.size())
    input_->tendon_force = other.tendon_force;
  else
    input_->tendon_force.setZero();
  if (other.tendon_target.size() == input_->tendon_target.size())
    input_->tendon_target = other.tendon_target;
  if (other.command.size() == input_->command.size()) input_->command = other.command;
  input_->z = other.z;
  for (const auto part : {&Input::attach, &Input::prescribed}) {
    VectorX& own = (*input_).*part;
    if ((other.*part).size() == own.size())
      own = other.*part;
    else
      own.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  input_->wrenches = other.wrenches;
  input_->softening = other.softening;
  input_->taut_links = other.taut_links;
}

constexpr const char* kInputDoc = R"(
What is applied from outside during a step: nothing at first, servo targets the model's.

Parameters
----------
model : Model
applied_force : array_like, shape (nv,), optional
    [N, N m], conjugate to v.
)";

constexpr const char* kAddWrenchDoc = R"(
Adds a force and torque on a link, constant over the step.

Parameters
----------
link : str or int
    Name or index of a frame.
force : array_like, shape (3,)
    In world axes [N].
torque : array_like, shape (3,)
    In world axes, about the point [N m].
point : array_like, shape (3,)
    In the frame of the link [m].
)";

// Long: declarations of the members of a class.
void bind_inputs(py::module_& m) {
  py::class_<InputHandle, InputPtr>(m, "Input", kInputDoc)
      .def(py::init([](const ModelPtr& model, const py::object& force) {
             auto input = std::make_shared<InputHandle>(model);
             if (!force.is_none()) set(input->applied_force, Array(force), "applied_force");
             return input;
           }),
           py::arg("model"), py::arg("applied_force") = py::none())
      .def_property(
          "applied_force", [](const InputHandle& i) { return i.applied_force; },
          [](InputHandle& i, const Array& x) { set(i.applied_force, x, "applied_force"); },
          "[N, N m], conjugate to v, shape (nv,), a view.")
      .def_property(
          "servo_position", [](const InputHandle& i) { return i.servo_position; },
          [](InputHandle& i, const Array& x) { set(i.servo_position, x, "servo_position"); },
          "Targets [rad or m], in the order of model.servos, a view.")
      .def_property(
          "servo_velocity", [](const InputHandle& i) { return i.servo_velocity; },
          [](InputHandle& i, const Array& x) { set(i.servo_velocity, x, "servo_velocity"); },
          "Targets [rad/s or m/s], in the order of model.servos, a view.")
      .def_property(
          "tendon_force", [](const InputHandle& i) { return i.tendon_force; },
          [](InputHandle& i, const Array& x) { set(i.tendon_force, x, "tendon_force"); },
          "[N] along tendons, pulling is negative, in the order of model.tendons, a view.")
      .def_property(
          "tendon_target", [](const InputHandle& i) { return i.tendon_target; },
          [](InputHandle& i, const Array& x) { set(i.tendon_target, x, "tendon_target"); },
          "Lengths [m] that servos of tendons aim at, in the order of model.tendons, a view.")
      .def_property(
          "prescribed", [](const InputHandle& i) { return i.prescribed; },
          [](InputHandle& i, const Array& x) { set(i.prescribed, x, "prescribed"); },
          "Coordinates of prescribed joints at the end of the step, shape (nq,), in the order of "
          "q; "
          "a joint with nan stands still. A view.")
      .def_property(
          "attach", [](const InputHandle& i) { return i.attach; },
          [](InputHandle& i, const Array& x) { set(i.attach, x, "attach"); },
          "Of switched closures: 1 attaches, 0 releases, nan leaves it as it is; in the order of "
          "model.closures, a view.")
      .def_property(
          "command", [](const InputHandle& i) { return i.command; },
          [](InputHandle& i, const Array& x) { set(i.command, x, "command"); },
          "Commands in the units of their actuators, in the order of model.actuators, a view.")
      .def_property(
          "z", [](const InputHandle& i) { return copy(i.value().z); },
          [](InputHandle& i, const Array& x) { i.value().z = vector(x, i.model->model.nz(), "z"); },
          "Internal states at the start of a step that is to be inverted (State.z), a copy; empty: "
          "the model's initial ones. Steps forward take those of their state.")
      .def(
          "__getitem__", [](const InputHandle& i, const std::string& name) { return i.at(name); },
          py::arg("name"), "input['elbow.u'], input['cube.fx'], input['elbow.target'].")
      .def(
          "__setitem__", [](InputHandle& i, const std::string& name, double x) { i.at(name) = x; },
          py::arg("name"), py::arg("value"))
      .def("add_wrench", &add_wrench, py::arg("link"), py::arg("force") = py::make_tuple(0, 0, 0),
           py::arg("torque") = py::make_tuple(0, 0, 0), py::arg("point") = py::make_tuple(0, 0, 0),
           kAddWrenchDoc)
      .def(
          "clear_wrenches", [](InputHandle& i) { i.value().wrenches.clear(); },
          "Takes all wrenches away.")
      .def_property_readonly(
          "num_wrenches", [](const InputHandle& i) { return i.value().wrenches.size(); },
          "How many there are.")
      .def(
          "clear",
          [](const InputPtr& i) {
            InputHandle fresh(i->model);
            i->assign(fresh.value());
          },
          "Back to nothing, targets to the model's.")
      .def_property(
          "softening",
          [](const InputHandle& i) {
            return std::pair(i.value().softening.factor, i.value().softening.tree);
          },
          [](InputHandle& i, const std::pair<double, int>& s) {
            i.value().softening = {s.first, s.second};
          },
          "Known of a step that is inverted or repeated: (factor, tree) as it reported.")
      .def_property(
          "taut_links", [](const InputHandle& i) { return tuples_of(i.value().taut_links); },
          [](InputHandle& i, const std::vector<std::tuple<int, double, double>>& links) {
            i.value().taut_links = taut_links_of(i.model->model, links);
          },
          "The same of links that were taut, as State.taut_links of the state it led to: (body, "
          "factor, kept) each. A step that is given some takes these and no others.")
      .def("__repr__", [](const InputHandle& i) {
        return py::str("<Input: applied_force {}, {} wrenches>")
            .format(i.applied_force, i.value().wrenches.size());
      });
}

}  // namespace counterpoint::python
