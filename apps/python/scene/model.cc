// Models and their parts. A part is a reference to the model and an index: cheap, and safe to keep.
#include <pybind11/stl.h>

#include "counterpoint/collision/collider.h"
#include "objects/geometry_words.h"
#include "objects/handles.h"

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
const Body& value(const BodyPart& b) { return b.model->model.body(b.index); }
const Frame& value(const FramePart& f) {
  return f.model->model.frames()[static_cast<size_t>(f.index)];
}
const Geometry& value(const GeometryPart& g) {
  return g.model->model.geometries()[static_cast<size_t>(g.index)];
}

std::string body_name(const Model& model, int body) {
  return body == 0 ? "world" : model.joint(body - 1).link;
}

template <class List>
std::vector<std::string> names_of(const List& list) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name);
  return names;
}

template <class P>
py::list parts(const ModelPtr& model, int count) {
  py::list out;
  for (int i = 0; i < count; ++i) out.append(P{model, i});
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
  const auto property = [&joint](const char* name, auto get, const char* doc) {
    joint.def_property_readonly(name, get, doc);
  };
  property(
      "body",
      [](const JointPart& j) {
        return BodyPart{j.model, j.index + 1};
      },
      "The Body that it moves.");
  property(
      "q",
      [](const JointPart& j) { return range(body_of(j).q_index, joint_nq(body_of(j).joint_type)); },
      "Slice of q that holds its coordinates.");
  property(
      "v",
      [](const JointPart& j) { return range(body_of(j).v_index, joint_nv(body_of(j).joint_type)); },
      "Slice of v that holds its velocities.");
  property(
      "default_q", [](const JointPart& j) { return at_joint(j, j.model->model.default_q(), true); },
      "Where it starts [rad, m, quaternion], read-only.");
  property(
      "damping", [](const JointPart& j) { return at_joint(j, j.model->model.damping()); },
      "Viscous, by velocity [N m s/rad or N s/m], read-only.");
  property(
      "armature", [](const JointPart& j) { return at_joint(j, j.model->model.armature()); },
      "Rotor inertia seen at the joint [kg m^2 or kg], read-only.");
  property(
      "dry_friction", [](const JointPart& j) { return at_joint(j, j.model->model.dry_friction()); },
      "[N m or N], read-only.");
  property(
      "has_servo", [](const JointPart& j) { return j.model->model.find_servo(j.index) >= 0; },
      "Is there a position and velocity controlled motor?");
  joint.def("__repr__", [](const JointPart& j) {
    return py::str("<Joint '{}' {} [{:.6g}, {:.6g}]>")
        .format(info(j).name, joint_type_name(body_of(j).joint_type), info(j).lower, info(j).upper);
  });
}

void bind_joint(py::module_& m) {
  py::class_<JointPart> joint(m, "Joint",
                              "A joint of a model, by which a body hangs on its parent.");
  const auto property = [&joint](const char* name, auto get, const char* doc) {
    joint.def_property_readonly(name, get, doc);
  };
  property(
      "index", [](const JointPart& j) { return j.index; }, "In model.joints.");
  property(
      "name", [](const JointPart& j) { return info(j).name; }, "Unique in the model.");
  property(
      "link", [](const JointPart& j) { return info(j).link; }, "The child link.");
  property(
      "type", [](const JointPart& j) { return joint_type_name(body_of(j).joint_type); },
      "revolute, prismatic, planar, spherical or floating.");
  property(
      "lower", [](const JointPart& j) { return info(j).lower; },
      "Lower limit [rad or m], -inf where there is none.");
  property(
      "upper", [](const JointPart& j) { return info(j).upper; },
      "Upper limit [rad or m], inf where there is none.");
  property(
      "effort_limit", [](const JointPart& j) { return info(j).effort_limit; },
      "[N m or N] in each coordinate.");
  property(
      "velocity_limit", [](const JointPart& j) { return info(j).velocity_limit; },
      "[rad/s or m/s] in each coordinate.");
  property(
      "actuated", [](const JointPart& j) { return info(j).actuated; },
      "False for a floating joint, or one that holds a base.");
  bind_joint_coordinates(joint);
}

void bind_body(py::module_& m) {
  py::class_<BodyPart>(m, "Body", "A rigid body of a model: links that fixed joints hold together.")
      .def_property_readonly(
          "index", [](const BodyPart& b) { return b.index; }, "In model.bodies; 0 is the world.")
      .def_property_readonly(
          "name", [](const BodyPart& b) { return body_name(b.model->model, b.index); },
          "Of its first link; 'world'.")
      .def_property_readonly(
          "parent",
          [](const BodyPart& b) -> py::object {
            if (b.index == 0) return py::none();
            return py::cast(BodyPart{b.model, value(b).parent});
          },
          "The Body it hangs on; None for the world.")
      .def_property_readonly(
          "joint",
          [](const BodyPart& b) -> py::object {
            if (b.index == 0) return py::none();
            return py::cast(JointPart{b.model, b.index - 1});
          },
          "The Joint it hangs on; None for the world.")
      .def_property_readonly(
          "tree", [](const BodyPart& b) { return value(b).tree; },
          "Kinematic tree; -1 for the world.")
      .def_property_readonly(
          "mass", [](const BodyPart& b) { return value(b).inertia.mass; }, "[kg]")
      .def_property_readonly(
          "inertia", [](const BodyPart& b) { return value(b).inertia; },
          "SpatialInertia in the body frame, which is turned from that of its first link so that "
          "the joint's axis is z; "
          "`model.frame(link).pose` is X_BF, from the link's axes to these.")
      .def("__repr__", [](const BodyPart& b) {
        return py::str("<Body '{}' {:.6g} kg>")
            .format(body_name(b.model->model, b.index), value(b).inertia.mass);
      });
}

void bind_frame_and_geometry(py::module_& m) {
  py::class_<FramePart>(m, "Frame", "A frame fixed to a body: every link has one.")
      .def_property_readonly(
          "index", [](const FramePart& f) { return f.index; }, "In model.frames.")
      .def_property_readonly(
          "name", [](const FramePart& f) { return value(f).name; }, "Of the link.")
      .def_property_readonly(
          "body",
          [](const FramePart& f) {
            return BodyPart{f.model, value(f).body};
          },
          "The Body it is fixed to.")
      .def_property_readonly(
          "pose", [](const FramePart& f) { return value(f).X_BF; }, "X_BF in the body frame.")
      .def("__repr__", [](const FramePart& f) { return "<Frame '" + value(f).name + "'>"; });
  py::class_<GeometryPart>(m, "Geometry", "A shape attached to a body.")
      .def_property_readonly(
          "index", [](const GeometryPart& g) { return g.index; }, "In model.geometries.")
      .def_property_readonly(
          "name", [](const GeometryPart& g) { return value(g).name; },
          "'<link>/<collision name or index>', or as given to the environment.")
      .def_property_readonly(
          "body",
          [](const GeometryPart& g) {
            return BodyPart{g.model, value(g).body};
          },
          "The Body it moves with.")
      .def_property_readonly(
          "pose", [](const GeometryPart& g) { return value(g).X_BG; }, "X_BG in the body frame.")
      .def_property_readonly(
          "shape", [](const GeometryPart& g) { return value(g).shape; }, "Shape.")
      .def_property_readonly(
          "material", [](const GeometryPart& g) { return value(g).material; },
          "A copy of its Material.")
      .def("__repr__", [](const GeometryPart& g) {
        return py::str("<Geometry '{}' {}>")
            .format(value(g).name, shape_type_name(value(g).shape.type));
      });
}

void bind_access(py::class_<ModelHandle, ModelPtr>& model) {
  model
      .def(
          "joint",
          [](const ModelPtr& m, const py::object& key) {
            return JointPart{m, index_from(
                                    key, m->model.num_joints(), "joint",
                                    [&](const auto& name) { return m->model.find_joint(name); },
                                    [&] { return names_of(m->model.joints()); })};
          },
          py::arg("key"), "The Joint of this name or index. Raises KeyError, IndexError.")
      .def(
          "body",
          [](const ModelPtr& m, const py::object& key) {
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
          [](const ModelPtr& m, const py::object& key) {
            return FramePart{m, index_from(
                                    key, static_cast<int>(m->model.frames().size()), "frame",
                                    [&](const auto& name) { return m->model.find_frame(name); },
                                    [&] { return names_of(m->model.frames()); })};
          },
          py::arg("key"), "The Frame of this name or index.")
      .def(
          "geometry",
          [](const ModelPtr& m, const py::object& key) {
            const auto& all = m->model.geometries();
            const auto find = [&](const std::string& name) {
              for (size_t i = 0; i < all.size(); ++i)
                if (all[i].name == name) return static_cast<int>(i);
              return -1;
            };
            return GeometryPart{m, index_from(key, static_cast<int>(all.size()), "geometry", find,
                                              [&] { return names_of(all); })};
          },
          py::arg("key"), "The Geometry of this name or index.");
}

py::list notes(const ModelPtr& m) {
  py::list out;
  for (const Note& note : collision::all_notes(m->model))
    out.append(py::make_tuple(note.where, note.message));
  return out;
}

void bind_vectors(py::class_<ModelHandle, ModelPtr>& model) {
  const auto property = [&model](const char* name, auto get, const char* doc) {
    model.def_property_readonly(name, get, doc);
  };
  property(
      "gravity",
      [](const ModelPtr& m) { return view(m->model.gravity().data(), {3}, {1}, py::cast(m)); },
      "[m/s^2] in the world frame, shape (3,), read-only.");
  property(
      "default_q", [](const ModelPtr& m) { return view(m->model.default_q(), py::cast(m)); },
      "Shape (nq,), read-only.");
  property(
      "damping", [](const ModelPtr& m) { return view(m->model.damping(), py::cast(m)); },
      "Viscous [N m s/rad or N s/m], shape (nv,), read-only.");
  property(
      "armature", [](const ModelPtr& m) { return view(m->model.armature(), py::cast(m)); },
      "Rotor inertia seen at the joints [kg m^2 or kg], shape (nv,), read-only.");
  property(
      "dry_friction", [](const ModelPtr& m) { return view(m->model.dry_friction(), py::cast(m)); },
      "[N m or N], shape (nv,), read-only.");
  property("notes", &notes, "What a reader must know: list of (where, message).");
}

void bind_properties(py::class_<ModelHandle, ModelPtr>& model) {
  const auto property = [&model](const char* name, auto get, const char* doc) {
    model.def_property_readonly(name, get, doc);
  };
  property(
      "nq", [](const ModelPtr& m) { return m->model.nq(); }, "Number of coordinates.");
  property(
      "nv", [](const ModelPtr& m) { return m->model.nv(); }, "Number of velocities.");
  property(
      "num_bodies", [](const ModelPtr& m) { return m->model.num_bodies(); }, "The world included.");
  property(
      "num_trees", [](const ModelPtr& m) { return m->model.num_trees(); }, "Kinematic trees.");
  property(
      "joints", [](const ModelPtr& m) { return parts<JointPart>(m, m->model.num_joints()); },
      "List of Joint.");
  property(
      "bodies", [](const ModelPtr& m) { return parts<BodyPart>(m, m->model.num_bodies()); },
      "List of Body, the world first.");
  property(
      "frames",
      [](const ModelPtr& m) {
        return parts<FramePart>(m, static_cast<int>(m->model.frames().size()));
      },
      "List of Frame.");
  property(
      "geometries",
      [](const ModelPtr& m) {
        return parts<GeometryPart>(m, static_cast<int>(m->model.geometries().size()));
      },
      "List of Geometry.");
  property(
      "servos",
      [](const ModelPtr& m) {
        py::list out;
        for (const JointServo& s : m->model.servos()) out.append(JointPart{m, s.joint});
        return out;
      },
      "Joints with a servo, in the order of Input.servo_position.");
  property(
      "closures", [](const ModelPtr& m) { return names_of(m->model.closures()); },
      "Names of what closes loops.");
  model.def(
      "pair_material",
      [](const ModelPtr& m, const std::string& a, const std::string& b) {
        const auto index = [&](const std::string& name) {
          const auto& all = m->model.geometries();
          for (size_t i = 0; i < all.size(); ++i)
            if (all[i].name == name) return static_cast<int>(i);
          throw py::key_error("no geometry '" + name + "'");
        };
        return m->model.pair_material(index(a), index(b));
      },
      py::arg("geometry_a"), py::arg("geometry_b"),
      "Material that two geometries, by name, have where they touch: combined, or given to the "
      "pair.");
  property(
      "coordinates", [](const ModelPtr& m) { return m->coordinates; },
      "Names of q, v and applied forces.");
  bind_vectors(model);
}

}  // namespace

void bind_model(py::module_& m) {
  py::class_<ModelHandle, ModelPtr> model(m, "Model", R"(
What a scene is made of: bodies in kinematic trees, joints, inertias, shapes. Immutable.

Made by load_scene or ModelBuilder. Arrays are views of the model's own memory, read-only.
)");
  bind_joint(m);
  bind_body(m);
  bind_frame_and_geometry(m);
  bind_properties(model);
  bind_access(model);
  model.def("__repr__", [](const ModelPtr& h) {
    return py::str("<Model: {} bodies, {} geometries, nq {}, nv {}>")
        .format(h->model.num_bodies() - 1, h->model.geometries().size(), h->model.nq(),
                h->model.nv());
  });
}

}  // namespace counterpoint::python
