// Links, joints and robots for ModelBuilder.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/robot_files.h"
#include "objects/exceptions.h"
#include "objects/handles.h"
#include "objects/typed.h"
#include "objects/words.h"

namespace counterpoint::python {
namespace {

constexpr int kNumJointTypes = 5;

JointType joint_type_from(const std::string& word) {
  return from_word<JointType>(
      word, "type",
      [](const std::string& w) { return find_word<JointType>(w, joint_type_name, kNumJointTypes); },
      joint_type_name, kNumJointTypes);
}

Vector3 unit(const Array& array, const char* name) {
  const Vector3 x = vector3(array, name);
  if (!(x.norm() > 0.0) || !x.allFinite())
    throw py::value_error(std::string(name) + ": expected a direction, found none");
  return x.normalized();
}

LinkSpec make_link(const std::string& name, const SpatialInertia& inertia,
                   const std::vector<LinkSpec::Collision>& collisions, const Drag& drag) {
  LinkSpec link;
  link.name = name;
  link.inertia = inertia;
  link.collisions = collisions;
  link.drag = drag;
  link.where = "link '" + name + "'";
  return link;
}

JointSpec make_joint(const std::string& name, const std::string& type, const std::string& parent,
                     const std::string& child, const PoseLike& pose, const Array& axis,
                     const py::kwargs& values) {
  JointSpec joint;
  joint.name = name;
  joint.fixed = type == "fixed";
  if (!joint.fixed) joint.type = joint_type_from(type);
  joint.parent = parent;
  joint.child = child;
  joint.X_PJ = pose_from(pose, "pose");
  joint.axis = unit(axis, "axis");
  joint.where = "joint '" + name + "'";
  const py::object object = py::cast(&joint, py::return_value_policy::reference);
  for (const std::pair<py::handle, py::handle> item : values) {
    if (!py::hasattr(object, item.first))
      throw py::type_error("JointSpec: no attribute '" + item.first.cast<std::string>() + "'");
    object.attr(item.first) = item.second;
  }
  return joint;
}

/// Sets `out` to the three numbers of an array, or to three times a number; nothing for None.
void set_axes(const py::object& value, const char* name, std::optional<Vector3>& out) {
  if (value.is_none()) return;
  const bool one = py::isinstance<py::float_>(value) || py::isinstance<py::int_>(value);
  out = one ? Vector3(Vector3::Constant(value.cast<double>())) : vector3(Array(value), name);
}

ClosureSpec make_closure(const std::string& link_a, const std::string& link_b,
                         const std::string& type, const py::object& anchor_a,
                         const py::object& anchor_b, const std::optional<double>& length,
                         const std::string& name, bool collide, const py::object& axis,
                         const std::optional<double>& pitch, bool rope, const py::object& stiffness,
                         const py::object& damping, const py::object& rotational_stiffness,
                         const py::object& rotational_damping) {
  ClosureSpec spec;
  spec.link_a = link_a;
  spec.link_b = link_b;
  spec.type = from_word<ClosureType>(
      type, "type",
      [](const std::string& w) {
        return find_word<ClosureType>(w, closure_type_name, kNumClosureTypes);
      },
      closure_type_name, kNumClosureTypes);
  if (!anchor_a.is_none()) spec.anchor_a = vector3(Array(anchor_a), "anchor_a");
  if (!anchor_b.is_none()) spec.anchor_b = vector3(Array(anchor_b), "anchor_b");
  spec.length = length;
  spec.name = name;
  spec.collide = collide;
  if (!axis.is_none()) spec.axis = vector3(Array(axis), "axis");
  spec.pitch = pitch;
  spec.rope = rope;
  set_axes(stiffness, "stiffness", spec.stiffness);
  set_axes(damping, "damping", spec.damping);
  set_axes(rotational_stiffness, "rotational_stiffness", spec.rotational_stiffness);
  set_axes(rotational_damping, "rotational_damping", spec.rotational_damping);
  spec.where = "closure between '" + link_a + "' and '" + link_b + "'";
  return spec;
}

constexpr const char* kDragDoc = R"(
How still air resists a link, the same in all directions.

Parameters
----------
linear, quadratic : float
    Force over speed [N s/m], over its square [N s^2/m^2].
angular, angular_quadratic : float
    Torque over angular speed [N m s], over its square [N m s^2].
)";

constexpr const char* kCollisionSpecDoc = R"(
A shape of a link.

Parameters
----------
shape : Shape
pose : Pose, optional
    X_LG in the link frame.
material : Material
name : str
    Empty: numbered.
)";

constexpr const char* kLinkSpecDoc = R"(
One link of a robot, or one free object.

Parameters
----------
name : str
inertia : SpatialInertia
    In the link frame.
collisions : sequence of CollisionSpec
drag : Drag
)";

void bind_link(py::module_& m) {
  py::class_<Drag>(m, "Drag", kDragDoc)
      .def(py::init([](double a, double b, double c, double d) {
             return Drag{a, b, c, d};
           }),
           py::arg("linear") = 0.0, py::arg("quadratic") = 0.0, py::arg("angular") = 0.0,
           py::arg("angular_quadratic") = 0.0)
      .def_readwrite("linear", &Drag::linear, "[N s/m]")
      .def_readwrite("quadratic", &Drag::quadratic, "[N s^2/m^2]")
      .def_readwrite("angular", &Drag::angular, "[N m s]")
      .def_readwrite("angular_quadratic", &Drag::angular_quadratic, "[N m s^2]");
  using C = LinkSpec::Collision;
  py::class_<C>(m, "CollisionSpec", kCollisionSpecDoc)
      .def(py::init([](const Shape& shape, const PoseLike& pose, const Material& material,
                       const std::string& name) {
             return C{name, pose_from(pose, "pose"), shape, material};
           }),
           py::arg("shape"), py::arg("pose") = py::none(), py::arg("material") = Material(),
           py::arg("name") = "")
      .def_readwrite("name", &C::name, "Empty: numbered.")
      .def_readwrite("shape", &C::shape, "Shape.")
      .def_readwrite("material", &C::material, "Material.")
      .def_property(
          "pose", [](const C& c) { return c.X_LG; },
          [](C& c, const PoseLike& X) { c.X_LG = pose_from(X, "pose"); },
          "X_LG in the link frame.");
  py::class_<LinkSpec>(m, "LinkSpec", kLinkSpecDoc)
      .def(py::init(&make_link), py::arg("name"), py::arg("inertia") = SpatialInertia(),
           py::arg("collisions") = std::vector<C>(), py::arg("drag") = Drag())
      .def_readwrite("name", &LinkSpec::name, "Unique in the robot.")
      .def_readwrite("inertia", &LinkSpec::inertia, "SpatialInertia in the link frame.")
      .def_readwrite("collisions", &LinkSpec::collisions, "List of CollisionSpec, a copy.")
      .def_readwrite("drag", &LinkSpec::drag, "Drag.")
      .def_readwrite("gravity_compensation", &LinkSpec::gravity_compensation,
                     "Share of the link's weight that a force carries, 1: all.")
      .def("__repr__", [](const LinkSpec& l) { return "<LinkSpec '" + l.name + "'>"; });
}

constexpr const char* kServoSpecDoc = R"(
A position and velocity controlled motor in a joint of one coordinate.

Parameters
----------
stiffness : float
    kp [N m/rad or N/m].
damping : float
    kd [N m s/rad or N s/m].
position : float, optional
    Target [rad or m]; default: where the joint starts.
velocity : float
    Target [rad/s or m/s].
)";

constexpr const char* kJointSpecDoc = R"(
What joins two links.

Parameters
----------
name : str
type : {'fixed', 'revolute', 'prismatic', 'planar', 'spherical', 'floating'}
parent, child : str
    Names of links.
pose : Pose, optional
    Joint frame in the parent link frame: the child link frame at q = 0.
axis : array_like, shape (3,)
    In the joint frame: of rotation or translation, normal of a plane.
**values
    Any of the other attributes.
)";

void bind_joint_spec(py::module_& m) {
  using J = JointSpec;
  py::class_<ServoSpec>(m, "ServoSpec", kServoSpecDoc)
      .def(py::init([](double kp, double kd, std::optional<double> p, double v) {
             return ServoSpec{kp, kd, p, v};
           }),
           py::arg("stiffness") = 0.0, py::arg("damping") = 0.0, py::arg("position") = py::none(),
           py::arg("velocity") = 0.0)
      .def_readwrite("stiffness", &ServoSpec::stiffness, "kp [N m/rad or N/m].")
      .def_readwrite("damping", &ServoSpec::damping, "kd [N m s/rad or N s/m].")
      .def_readwrite("position", &ServoSpec::position, "Target [rad or m], or None.")
      .def_readwrite("velocity", &ServoSpec::velocity, "Target [rad/s or m/s].");
  py::class_<J>(m, "JointSpec", kJointSpecDoc)
      .def(py::init(&make_joint), py::arg("name"), py::arg("type"), py::arg("parent"),
           py::arg("child"), py::arg("pose") = py::none(),
           py::arg("axis") = py::make_tuple(1, 0, 0))
      .def_readwrite("name", &J::name, "Unique in the robot.")
      .def_readwrite("parent", &J::parent, "Name of a link.")
      .def_readwrite("child", &J::child, "Name of a link.")
      .def_readwrite("lower", &J::lower, "Limit [rad or m].")
      .def_readwrite("upper", &J::upper, "Limit [rad or m].")
      .def_readwrite("effort_limit", &J::effort_limit, "[N m or N]")
      .def_readwrite("velocity_limit", &J::velocity_limit, "[rad/s or m/s]")
      .def_readwrite("damping", &J::damping, "Viscous [N m s/rad or N s/m].")
      .def_readwrite("dry_friction", &J::dry_friction, "[N m or N]")
      .def_readwrite("breakaway_friction", &J::breakaway_friction,
                     "At rest [N m or N], at least dry_friction; 0: the same.")
      .def_readwrite("stribeck_speed", &J::stribeck_speed,
                     "Speed at which 1 / e of the excess at rest is left [rad/s or m/s].")
      .def_readwrite("armature", &J::armature, "Rotor inertia seen at the joint [kg m^2 or kg].")
      .def_readwrite("stiffness", &J::stiffness, "Of a spring [N m/rad or N/m].")
      .def_readwrite("reference", &J::reference, "Of the spring [rad or m].")
      .def_readwrite("servo", &J::servo, "ServoSpec.")
      .def_readwrite("mimic_master", &J::mimic_master, "Joint that it follows; empty: none.")
      .def_readwrite("mimic_multiplier", &J::mimic_multiplier, "q = multiplier q_master + offset.")
      .def_readwrite("mimic_offset", &J::mimic_offset, "[rad or m]")
      .def_readwrite("prescribed", &J::prescribed, "Whether Input.prescribed gives its motion.")
      .def("__repr__", [](const J& j) {
        return "<JointSpec '" + j.name + "' " + (j.fixed ? "fixed" : joint_type_name(j.type)) + ">";
      });
}

constexpr const char* kRobotSpecDoc = R"(
A robot or object before it is placed in a scene.

Parameters
----------
name : str
links : sequence of LinkSpec
joints : sequence of JointSpec
    They form one tree.
)";

constexpr const char* kClosureSpecDoc = R"(
What holds two links together beyond the joints of a tree, so that loops close.

Parameters
----------
link_a, link_b : str
    With prefix; 'world' is the world.
type : {'ball', 'weld', 'distance', 'hinge', 'slider', 'prismatic', 'cylindrical', 'screw'}
anchor_a, anchor_b : array_like, shape (3,), optional
    In the frames of the links [m]; what is left open follows from the start.
length : float, optional
    Of a distance [m].
name : str
    Empty: numbered.
collide : bool
    May the two bodies touch?
axis : array_like, shape (3,), optional
    Of a hinge, slider, prismatic, cylindrical or screw closure, in link a; default: z.
pitch : float, optional
    Of a screw, the way along the axis per turn [m].
rope : bool
    Makes a distance pull only, where it is longer than its length.
stiffness, damping : float or array_like, shape (3,), optional
    Of a spring and damper in place of a rigid closure [N/m, N s/m], along the axes of link a, or of
    a frame whose z axis is the axis.
rotational_stiffness, rotational_damping : float or array_like, shape (3,), optional
    The same of the angles that the type holds [N m/rad, N m s/rad].
)";

constexpr const char* kLoadUrdfDoc = R"(
Reads a URDF file, for ModelBuilder.add_robot.

Parameters
----------
file : path
packages : dict of str to path
    Folders of package:// names.
repair_inertias : bool
    Makes inertias physical that are not, and notes each.
repair_joints : bool
    Exchanges limits that are swapped, drops mimics between joints of different kinds, and notes each.

Returns
-------
RobotSpec
)";

constexpr const char* kObjectOfDoc = R"(
A free object of one shape and uniform density: a link 'body' with a collision 'shape'.

Parameters
----------
name : str
shape : Shape
    Sphere, box, capsule or cylinder.
mass : float
    [kg]
material : Material

Returns
-------
RobotSpec
    For ModelBuilder.add_robot.
)";

void bind_robot(py::module_& m) {
  py::class_<RobotSpec>(m, "RobotSpec", kRobotSpecDoc)
      .def(py::init([](const std::string& name, const std::vector<LinkSpec>& links,
                       const std::vector<JointSpec>& joints) {
             RobotSpec robot;
             robot.name = name;
             robot.links = links;
             robot.joints = joints;
             robot.where = "robot '" + name + "'";
             return robot;
           }),
           py::arg("name"), py::arg("links"), py::arg("joints") = std::vector<JointSpec>())
      .def_readwrite("name", &RobotSpec::name, "Of the robot.")
      .def_readwrite("links", &RobotSpec::links, "List of LinkSpec, a copy.")
      .def_readwrite("joints", &RobotSpec::joints, "List of JointSpec, a copy.")
      .def_readwrite("prescribed_base", &RobotSpec::prescribed_base,
                     "Whether Input.prescribed gives the motion of a base that is not fixed.")
      .def("__repr__", [](const RobotSpec& r) {
        return py::str("<RobotSpec '{}': {} links>").format(r.name, r.links.size());
      });
  py::class_<ClosureSpec>(m, "ClosureSpec", kClosureSpecDoc)
      .def(py::init(&make_closure), py::arg("link_a"), py::arg("link_b"), py::arg("type") = "ball",
           py::arg("anchor_a") = py::none(), py::arg("anchor_b") = py::none(),
           py::arg("length") = py::none(), py::arg("name") = "", py::arg("collide") = false,
           py::kw_only(), py::arg("axis") = py::none(), py::arg("pitch") = py::none(),
           py::arg("rope") = false, py::arg("stiffness") = py::none(),
           py::arg("damping") = py::none(), py::arg("rotational_stiffness") = py::none(),
           py::arg("rotational_damping") = py::none())
      .def_readwrite("switched", &ClosureSpec::switched,
                     "Whether Input.attach attaches and releases it.")
      .def_readwrite("attached", &ClosureSpec::attached,
                     "Whether it is attached at the start, if it is switched.")
      .def_readwrite("in_place", &ClosureSpec::in_place,
                     "Whether a switched weld holds the pose in which it was attached.")
      .def_readwrite("breaking_force", &ClosureSpec::breaking_force,
                     "Force [N] above which a switched one breaks.")
      .def_readwrite("breaking_torque", &ClosureSpec::breaking_torque,
                     "Torque [N m] above which a switched one breaks.");
  m.def(
      "load_urdf",
      [](const std::filesystem::path& file,
         const std::map<std::string, std::filesystem::path>& packages, bool repair_inertias,
         bool repair_joints) {
        UrdfOptions options;
        options.packages = packages;
        options.repair_inertias = repair_inertias;
        options.repair_joints = repair_joints;
        return reading(file, [&] { return load_urdf(file, options); });
      },
      py::arg("file"), py::kw_only(),
      py::arg("packages") = std::map<std::string, std::filesystem::path>(),
      py::arg("repair_inertias") = false, py::arg("repair_joints") = false, kLoadUrdfDoc);
  m.def("object_of", &object_of, py::arg("name"), py::arg("shape"), py::arg("mass"),
        py::arg("material") = Material(), kObjectOfDoc);
}

}  // namespace

void bind_specs(py::module_& m) {
  bind_link(m);
  bind_joint_spec(m);
  bind_robot(m);
}

}  // namespace counterpoint::python
