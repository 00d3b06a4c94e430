// Models and their parts. A part is a reference to the model and an index: cheap, and safe to keep.
#include <pybind11/stl.h>

#include "counterpoint/collision/collider.h"
#include "objects/geometry_words.h"
#include "objects/handles.h"
#include "objects/properties.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

template <class Tag>
struct Part {
  ModelPtr model;
  int index;
};
using JointPart = Part<JointInfo>;
using BodyPart = Part<Body>;
using FramePart = Part<Frame>;
using GeometryPart = Part<Geometry>;

const JointInfo& info(const JointPart& j) { return j.model->model.joint(j.index); }
const Body& body_of(const JointPart& j) { return j.model->model.body(j.index + 1); }
const Body& body_at(const BodyPart& b) { return b.model->model.body(b.index); }
const Frame& frame_at(const FramePart& f) {
  return f.model->model.frames()[static_cast<size_t>(f.index)];
}
const Geometry& geometry_at(const GeometryPart& g) {
  return g.model->model.geometries()[static_cast<size_t>(g.index)];
}

std::string body_name(const Model& model, int body) {
  return body == 0 ? "world" : model.joint(body - 1).link;
}

template <class P>
std::vector<P> parts(const ModelPtr& model, size_t count) {
  std::vector<P> out;
  for (size_t i = 0; i < count; ++i) out.push_back({model, static_cast<int>(i)});
  return out;
}

py::slice range(int begin, int size) { return {begin, begin + size, 1}; }

/// Entries of one of the model's vectors for the joint.
py::array at_joint(const JointPart& j, const VectorX& values, bool positions = false) {
  const Body& b = body_of(j);
  const double* first = values.data() + (positions ? b.q_index : b.v_index);
  const int count = positions ? joint_nq(b.joint_type) : joint_nv(b.joint_type);
  return view(first, {count}, {1}, py::cast(j.model));
}

void bind_joint_coordinates(py::class_<JointPart>& joint) {
  joint
      .def_property_readonly(
          "body",
          [](const JointPart& j) {
            return BodyPart{j.model, j.index + 1};
          },
          "The Body that it moves.")
      .def_property_readonly(
          "q",
          [](const JointPart& j) {
            return range(body_of(j).q_index, joint_nq(body_of(j).joint_type));
          },
          "Slice of q that holds its coordinates.")
      .def_property_readonly(
          "v",
          [](const JointPart& j) {
            return range(body_of(j).v_index, joint_nv(body_of(j).joint_type));
          },
          "Slice of v that holds its velocities.")
      .def_property_readonly(
          "default_q",
          [](const JointPart& j) { return at_joint(j, j.model->model.default_q(), true); },
          "Where it starts [rad, m, quaternion], read-only.")
      .def_property_readonly(
          "damping", [](const JointPart& j) { return at_joint(j, j.model->model.damping()); },
          "Viscous, by velocity [N m s/rad or N s/m], read-only.")
      .def_property_readonly(
          "armature", [](const JointPart& j) { return at_joint(j, j.model->model.armature()); },
          "Rotor inertia seen at the joint [kg m^2 or kg], read-only.")
      .def_property_readonly(
          "dry_friction",
          [](const JointPart& j) { return at_joint(j, j.model->model.dry_friction()); },
          "[N m or N], read-only.")
      .def_property_readonly(
          "breakaway_friction",
          [](const JointPart& j) { return at_joint(j, j.model->model.breakaway_friction()); },
          "At rest, where it is above dry_friction [N m or N], read-only.")
      .def_property_readonly(
          "stribeck_speed",
          [](const JointPart& j) { return at_joint(j, j.model->model.stribeck_speed()); },
          "Speed at which 1 / e of the excess at rest is left [rad/s or m/s], read-only.")
      .def_property_readonly(
          "has_servo", [](const JointPart& j) { return j.model->model.find_servo(j.index) >= 0; },
          "Is there a position and velocity controlled motor?")
      .def("__repr__", [](const JointPart& j) {
        return py::str("<Joint '{}' {} [{:.6g}, {:.6g}]>")
            .format(info(j).name, joint_type_name(body_of(j).joint_type), info(j).lower,
                    info(j).upper);
      });
}

void bind_joint(py::class_<JointPart>& joint) {
  joint.def_readonly("index", &JointPart::index, "In model.joints.")
      .def_property_readonly("name", through(&info, &JointInfo::name), "Unique in the model.")
      .def_property_readonly("link", through(&info, &JointInfo::link), "The child link.")
      .def_property_readonly(
          "type", [](const JointPart& j) { return joint_type_name(body_of(j).joint_type); },
          "revolute, prismatic, planar, spherical or floating.")
      .def_property_readonly("lower", through(&info, &JointInfo::lower),
                             "Lower limit [rad or m], -inf where there is none.")
      .def_property_readonly("upper", through(&info, &JointInfo::upper),
                             "Upper limit [rad or m], inf where there is none.")
      .def_property_readonly("effort_limit", through(&info, &JointInfo::effort_limit),
                             "[N m or N] in each coordinate.")
      .def_property_readonly("velocity_limit", through(&info, &JointInfo::velocity_limit),
                             "[rad/s or m/s] in each coordinate.")
      .def_property_readonly("actuated", through(&info, &JointInfo::actuated),
                             "False for a floating joint, or one that holds a base.")
      .def_property_readonly("prescribed", through(&info, &JointInfo::prescribed),
                             "True if Input.prescribed gives its motion.");
  bind_joint_coordinates(joint);
}

void bind_body(py::class_<BodyPart>& body) {
  body.def_readonly("index", &BodyPart::index, "In model.bodies; 0 is the world.")
      .def_property_readonly(
          "name", [](const BodyPart& b) { return body_name(b.model->model, b.index); },
          "Of its first link; 'world'.")
      .def_property_readonly(
          "parent",
          [](const BodyPart& b) -> std::optional<BodyPart> {
            if (b.index == 0) return std::nullopt;
            return BodyPart{b.model, body_at(b).parent};
          },
          "The Body it hangs on; None for the world.")
      .def_property_readonly(
          "joint",
          [](const BodyPart& b) -> std::optional<JointPart> {
            if (b.index == 0) return std::nullopt;
            return JointPart{b.model, b.index - 1};
          },
          "The Joint it hangs on; None for the world.")
      .def_property_readonly("tree", through(&body_at, &Body::tree),
                             "Kinematic tree; -1 for the world.")
      .def_property_readonly(
          "mass", [](const BodyPart& b) { return body_at(b).inertia.mass; }, "[kg]")
      .def_property_readonly(
          "inertia", through(&body_at, &Body::inertia),
          "SpatialInertia in the body frame, which is turned from that of its first link so that "
          "the joint's axis is z; "
          "`model.frame(link).pose` is X_BF, from the link's axes to these.")
      .def("__repr__", [](const BodyPart& b) {
        return py::str("<Body '{}' {:.6g} kg>")
            .format(body_name(b.model->model, b.index), body_at(b).inertia.mass);
      });
}

void bind_frame(py::class_<FramePart>& frame) {
  frame.def_readonly("index", &FramePart::index, "In model.frames.")
      .def_property_readonly("name", through(&frame_at, &Frame::name), "Of the link.")
      .def_property_readonly(
          "body",
          [](const FramePart& f) {
            return BodyPart{f.model, frame_at(f).body};
          },
          "The Body it is fixed to.")
      .def_property_readonly("pose", through(&frame_at, &Frame::X_BF), "X_BF in the body frame.")
      .def("__repr__", [](const FramePart& f) { return "<Frame '" + frame_at(f).name + "'>"; });
}

void bind_geometry(py::class_<GeometryPart>& geometry) {
  geometry.def_readonly("index", &GeometryPart::index, "In model.geometries.")
      .def_property_readonly("name", through(&geometry_at, &Geometry::name),
                             "'<link>/<collision name or index>', or as given to the environment.")
      .def_property_readonly(
          "body",
          [](const GeometryPart& g) {
            return BodyPart{g.model, geometry_at(g).body};
          },
          "The Body it moves with.")
      .def_property_readonly("pose", through(&geometry_at, &Geometry::X_BG),
                             "X_BG in the body frame.")
      .def_property_readonly("shape", through(&geometry_at, &Geometry::shape), "Shape.")
      .def_property_readonly("material", through(&geometry_at, &Geometry::material),
                             "A copy of its Material.")
      .def("__repr__", [](const GeometryPart& g) {
        return py::str("<Geometry '{}' {}>")
            .format(geometry_at(g).name, shape_type_name(geometry_at(g).shape.type));
      });
}

void bind_access(py::class_<ModelHandle, ModelPtr>& model) {
  model
      .def(
          "joint",
          [](const ModelPtr& m, const Key& key) {
            return JointPart{m, index_from(
                                    key, m->model.num_joints(), "joint",
                                    [&](const auto& name) { return m->model.find_joint(name); },
                                    [&] { return names_of(m->model.joints()); })};
          },
          py::arg("key"), "The Joint of this name or index. Raises KeyError, IndexError.")
      .def(
          "body",
          [](const ModelPtr& m, const Key& key) {
            const auto find = [&](const std::string& name) {
              for (int i = 0; i < m->model.num_bodies(); ++i)
                if (body_name(m->model, i) == name) return i;
              const int frame = m->model.find_frame(name);
              return frame < 0 ? -1 : m->model.frames()[static_cast<size_t>(frame)].body;
            };
            return BodyPart{m, index_from(key, m->model.num_bodies(), "body", find,
                                          [&] { return names_of(m->model.frames()); })};
          },
          py::arg("key"), "The Body of this name (or of the link of this name) or index.")
      .def(
          "frame",
          [](const ModelPtr& m, const Key& key) {
            return FramePart{m, index_from(
                                    key, static_cast<int>(m->model.frames().size()), "frame",
                                    [&](const auto& name) { return m->model.find_frame(name); },
                                    [&] { return names_of(m->model.frames()); })};
          },
          py::arg("key"), "The Frame of this name or index.")
      .def(
          "geometry",
          [](const ModelPtr& m, const Key& key) {
            return GeometryPart{m, geometry_index(*m, key)};
          },
          py::arg("key"), "The Geometry of this name or index.");
}

std::vector<std::pair<std::string, std::string>> notes(const ModelHandle& m) {
  std::vector<std::pair<std::string, std::string>> out;
  for (const Note& note : collision::all_notes(m.model)) out.emplace_back(note.where, note.message);
  return out;
}

Material pair_material(const ModelHandle& m, const std::string& a, const std::string& b) {
  return m.model.pair_material(geometry_index(m, py::str(a)), geometry_index(m, py::str(b)));
}

void bind_lists(py::class_<ModelHandle, ModelPtr>& model) {
  model
      .def_property_readonly(
          "joints", [](const ModelPtr& m) { return parts<JointPart>(m, m->model.joints().size()); },
          "List of Joint.")
      .def_property_readonly(
          "bodies", [](const ModelPtr& m) { return parts<BodyPart>(m, m->model.bodies().size()); },
          "List of Body, the world first.")
      .def_property_readonly(
          "frames", [](const ModelPtr& m) { return parts<FramePart>(m, m->model.frames().size()); },
          "List of Frame.")
      .def_property_readonly(
          "geometries",
          [](const ModelPtr& m) { return parts<GeometryPart>(m, m->model.geometries().size()); },
          "List of Geometry.")
      .def_property_readonly(
          "servos",
          [](const ModelPtr& m) {
            std::vector<JointPart> out;
            for (const JointServo& s : m->model.servos()) out.push_back({m, s.joint});
            return out;
          },
          "Joints with a servo, in the order of Input.servo_position.")
      .def_property_readonly(
          "closures", [](const ModelHandle& m) { return names_of(m.model.closures()); },
          "Names of what closes loops.")
      .def_property_readonly(
          "actuators", [](const ModelHandle& m) { return names_of(m.model.actuators()); },
          "Names of the actuators.")
      .def_property_readonly(
          "tendons", [](const ModelHandle& m) { return names_of(m.model.tendons()); },
          "Names of the tendons.")
      .def(
          "tendon_lengths",
          [](const ModelHandle& m, const Array& q) {
            const VectorX at = vector(q, m.model.nq(), "q");
            const std::vector<Pose> X_WB = body_poses(m.model, at);
            std::vector<double> lengths;
            for (const Tendon& tendon : m.model.tendons())
              lengths.push_back(tendon_length(m.model, tendon, at, X_WB));
            return lengths;
          },
          py::arg("q"), "Lengths of the tendons at q [m], in the order of model.tendons.")
      .def_property_readonly(
          "sensors", [](const ModelHandle& m) { return m.model.sensors(); }, "List of Sensor.")
      .def("pair_material", &pair_material, py::arg("geometry_a"), py::arg("geometry_b"),
           "Material that two geometries, by name, have where they touch: combined, or given to "
           "the pair.")
      .def_readonly("coordinates", &ModelHandle::coordinates, "Names of q, v and applied forces.");
}

void bind_vectors(py::class_<ModelHandle, ModelPtr>& model) {
  model
      .def_property_readonly(
          "gravity",
          [](const ModelPtr& m) { return view(m->model.gravity().data(), {3}, {1}, py::cast(m)); },
          "[m/s^2] in the world frame, shape (3,), read-only.")
      .def_property_readonly(
          "default_q", [](const ModelPtr& m) { return view(m->model.default_q(), py::cast(m)); },
          "Shape (nq,), read-only.")
      .def_property_readonly(
          "damping", [](const ModelPtr& m) { return view(m->model.damping(), py::cast(m)); },
          "Viscous [N m s/rad or N s/m], shape (nv,), read-only.")
      .def_property_readonly(
          "armature", [](const ModelPtr& m) { return view(m->model.armature(), py::cast(m)); },
          "Rotor inertia seen at the joints [kg m^2 or kg], shape (nv,), read-only.")
      .def_property_readonly(
          "dry_friction",
          [](const ModelPtr& m) { return view(m->model.dry_friction(), py::cast(m)); },
          "[N m or N], shape (nv,), read-only.")
      .def_property_readonly(
          "breakaway_friction",
          [](const ModelPtr& m) { return view(m->model.breakaway_friction(), py::cast(m)); },
          "At rest, where it is above dry_friction [N m or N], shape (nv,), read-only.")
      .def_property_readonly(
          "stribeck_speed",
          [](const ModelPtr& m) { return view(m->model.stribeck_speed(), py::cast(m)); },
          "Speeds at which 1 / e of that excess is left [rad/s or m/s], shape (nv,), read-only.")
      .def_property_readonly("notes", &notes, "What a reader must know: list of (where, message).");
}

void bind_sensor(py::class_<Sensor>& sensor) {
  sensor.def_readonly("name", &Sensor::name, "Unique in the model.")
      .def_property_readonly(
          "kinds",
          [](const Sensor& s) {
            std::vector<std::string> kinds;
            for (const SensorKind kind : s.kinds) kinds.emplace_back(sensor_kind_name(kind));
            return kinds;
          },
          "What it reads: \"specific_force\", \"angular_velocity\" ...")
      .def_property_readonly(
          "rate", [](const Sensor& s) { return s.errors.rate; },
          "Samples per second [Hz]; zero: one for every row.")
      .def_property_readonly(
          "delay", [](const Sensor& s) { return s.errors.delay; }, "[s]")
      .def("__repr__", [](const Sensor& s) { return "<Sensor: " + s.name + ">"; });
}

}  // namespace

void bind_model(py::module_& m) {
  py::class_<ModelHandle, ModelPtr> model(m, "Model", R"(
What a scene is made of: bodies in kinematic trees, joints, inertias, shapes. Immutable.

Made by load_scene or ModelBuilder. Arrays are views of the model's own memory, read-only.
)");
  // A signature names the classes that are bound before it.
  py::class_<JointPart> joint(m, "Joint",
                              "A joint of a model, by which a body hangs on its parent.");
  py::class_<BodyPart> body(m, "Body",
                            "A rigid body of a model: links that fixed joints hold together.");
  py::class_<FramePart> frame(m, "Frame", "A frame fixed to a body: every link has one.");
  py::class_<GeometryPart> geometry(m, "Geometry", "A shape attached to a body.");
  py::class_<Sensor> sensor(m, "Sensor", "A sensor of a model: what a robot measures.");
  bind_sensor(sensor);
  bind_joint(joint);
  bind_body(body);
  bind_frame(frame);
  bind_geometry(geometry);
  using M = ModelHandle;
  model.def_property_readonly("nq", through(&M::model, &Model::nq), "Number of coordinates.")
      .def_property_readonly("nv", through(&M::model, &Model::nv), "Number of velocities.")
      .def_property_readonly("num_bodies", through(&M::model, &Model::num_bodies),
                             "The world included.")
      .def_property_readonly("num_trees", through(&M::model, &Model::num_trees),
                             "Kinematic trees.");
  bind_lists(model);
  bind_vectors(model);
  bind_access(model);
  model.def("__repr__", [](const ModelPtr& h) {
    return py::str("<Model: {} bodies, {} geometries, nq {}, nv {}>")
        .format(h->model.num_bodies() - 1, h->model.geometries().size(), h->model.nq(),
                h->model.nv());
  });
}

}  // namespace counterpoint::python
