// Builds a Model from robots and environment, without a file.
#include <pybind11/stl.h>

#include "bindings.h"
#include "counterpoint/model/model_builder.h"
#include "objects/arrays.h"
#include "objects/exceptions.h"
#include "objects/handles.h"
#include "objects/typed.h"
#include "objects/words.h"

namespace counterpoint::python {

void bind_specs(py::module_& m);  // specs.cc

namespace {

void set_pair_surface(ModelBuilder& b, const std::string& geometry_or_link_a,
                      const std::string& geometry_or_link_b, std::optional<double> friction,
                      std::optional<double> restitution, std::optional<double> torsional_friction,
                      std::optional<double> rolling_friction, std::optional<double> static_friction,
                      std::optional<double> stribeck_speed, std::optional<double> stiffness,
                      std::optional<double> damping, std::optional<double> dissipation,
                      const std::optional<Array>& friction_axis, double friction_across,
                      std::optional<double> stiffness_per_area,
                      std::optional<double> damping_per_area) {
  std::optional<Vector3> axis;
  if (friction_axis) axis = vector3(*friction_axis, "friction_axis");
  b.set_pair_surface(geometry_or_link_a, geometry_or_link_b,
                     {friction, restitution, torsional_friction, rolling_friction, static_friction,
                      stribeck_speed, stiffness, damping, dissipation, stiffness_per_area,
                      damping_per_area, axis, friction_across});
}

}  // namespace

constexpr const char* kModelBuilderDoc = R"(
Collects robots and environment, then makes the Model. After an exception not to be used any further.

Parameters
----------
gravity : array_like, shape (3,)
    [m/s^2] in the world frame.
)";

constexpr const char* kSetPairSurfaceDoc = R"(
Surface values of two geometries, or of all geometries of links, in place of what their materials
combine to. Of several for one pair the last counts.

Parameters
----------
geometry_or_link_a, geometry_or_link_b : str
friction, restitution, torsional_friction, rolling_friction : float, optional
static_friction, stribeck_speed, stiffness, damping, dissipation : float, optional
stiffness_per_area, damping_per_area : float, optional
    As of Material; those left out are combined.
friction_axis : array_like, shape (3,), optional
friction_across : float
    As of Material, with friction; the axis is in the frame of the first geometry.
)";

constexpr const char* kFillInertiaDoc = R"(
Gives inertia to links that build would refuse for moving none: a ball of this mass and the density
of water. Each is noted (Model.notes).

Parameters
----------
mass : float
    [kg]
)";

constexpr const char* kAddRobotDoc = R"(
Adds a robot whose root link is welded to the world, floats, or turns about its origin.

Parameters
----------
robot : RobotSpec
base : {'fixed', 'floating', 'spherical'}
    The joint of a base that is not fixed is named after the root link.
pose : Pose, optional
    X_WL of the root link at the start.
prefix : str
    Goes before every name.

Returns
-------
int
    Index of the instance.
)";

void bind_builder(py::module_& m) {
  bind_specs(m);
  using B = ModelBuilder;
  py::class_<B>(m, "ModelBuilder", kModelBuilderDoc)
      .def(py::init([](const Array& g) { return B(vector3(g, "gravity")); }),
           py::arg("gravity") = py::make_tuple(0.0, 0.0, -kStandardGravity))
      .def(
          "add_robot",
          [](B& b, const RobotSpec& robot, const std::string& base, const PoseLike& pose,
             const std::string& prefix) {
            return b.add_robot(robot, base_from(base), pose_from(pose, "pose"), prefix);
          },
          py::arg("robot"), py::arg("base") = "fixed", py::arg("pose") = py::none(),
          py::arg("prefix") = "", kAddRobotDoc)
      .def(
          "add_environment",
          [](B& b, const std::string& name, const Shape& shape, const PoseLike& pose,
             const Material& material) {
            return b.add_environment(name, shape, pose_from(pose, "pose"), material);
          },
          py::arg("name"), py::arg("shape"), py::arg("pose") = py::none(),
          py::arg("material") = Material(), "Adds geometry fixed to the world; returns its index.")
      .def(
          "set_default_position",
          [](B& b, const std::string& joint, const Array& q) {
            const Array flat = py::reinterpret_borrow<Array>(q.attr("reshape")(-1));
            b.set_default_position(joint, vector(flat, flat.size(), "q"));
          },
          py::arg("joint"), py::arg("q"), "Coordinates of a joint in the default configuration.")
      .def("exclude_pair", &B::exclude_pair, py::arg("geometry_or_link_a"),
           py::arg("geometry_or_link_b"), py::arg("reason") = "",
           "No contact between two geometries, or all geometries of links.")
      .def("include_pair", &B::include_pair, py::arg("geometry_or_link_a"),
           py::arg("geometry_or_link_b"),
           "Contact between two geometries, or all geometries of links, even if a joint joins the "
           "links, they overlap "
           "in the default pose, or exclude_pair names them.")
      .def("set_pair_surface", &set_pair_surface, py::arg("geometry_or_link_a"),
           py::arg("geometry_or_link_b"), py::kw_only(), py::arg("friction") = py::none(),
           py::arg("restitution") = py::none(), py::arg("torsional_friction") = py::none(),
           py::arg("rolling_friction") = py::none(), py::arg("static_friction") = py::none(),
           py::arg("stribeck_speed") = py::none(), py::arg("stiffness") = py::none(),
           py::arg("damping") = py::none(), py::arg("dissipation") = py::none(),
           py::arg("friction_axis") = py::none(), py::arg("friction_across") = 0.0,
           py::arg("stiffness_per_area") = py::none(), py::arg("damping_per_area") = py::none(),
           kSetPairSurfaceDoc)
      .def("fill_inertia", &B::fill_inertia, py::arg("mass"), kFillInertiaDoc)
      .def("add_closure", &B::add_closure, py::arg("closure"), "Ties two links together.")
      .def(
          "build",
          [](const B& b) {
            B own = b;
            const py::gil_scoped_release release;
            return std::make_shared<ModelHandle>(own.build());
          },
          "The Model; the builder is empty afterwards.");
}

}  // namespace counterpoint::python
