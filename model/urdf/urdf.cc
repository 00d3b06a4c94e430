#include <fmt/format.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>
#include <tuple>

#include "counterpoint/model/files/captured_messages.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"
#include "counterpoint/model/urdf/urdf_xml.h"

namespace counterpoint {
namespace {

constexpr double kPointRadius = 1e-5;  // [m], for spheres given with radius 0

urdf::ModelInterfaceSharedPtr parse(const UrdfXml& xml, const std::string& file) {
  // console_bridge has one output handler for the whole process.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  const CapturedMessages messages;
  std::string errors;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(xml.standard_xml);
    errors = messages.errors();
  } catch (const std::exception& error) {
    errors = fmt::format("{} {}", messages.errors(), error.what());
  }
  // A model that urdfdom returns with errors lacks the elements that it could not read.
  if (model && errors.empty()) return model;
  // urdfdom names elements but no lines: report the line of the first element that it names.
  int line = 1;
  size_t first = std::string::npos;
  const auto consider = [&](const std::string& name, int at) {
    for (const std::string& quoted : {"[" + name + "]", "'" + name + "'"}) {
      const size_t found = errors.find(quoted);
      if (found < first) std::tie(first, line) = std::pair(found, at);
    }
  };
  for (const auto& [name, link] : xml.links) consider(name, link.line);
  for (const auto& [name, joint] : xml.joints) consider(name, joint.line);
  if (xml.standard_xml.find("$(") != std::string::npos ||
      xml.standard_xml.find("${") != std::string::npos) {
    errors += "; the file still holds xacro expressions: expand it with xacro first";
  }
  throw InputError(fmt::format("{}:{}: {}", file, line, errors.empty() ? "no valid URDF" : errors));
}

Vector3 to_vector(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Pose to_pose(const urdf::Pose& p) {
  const Quaternion q(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z);
  return {q.normalized().toRotationMatrix(), to_vector(p.position)};
}

SpatialInertia to_inertia(const urdf::Inertial& in) {
  const Pose pose = to_pose(in.origin);
  Matrix3 rotational;
  rotational << in.ixx, in.ixy, in.ixz, in.ixy, in.iyy, in.iyz, in.ixz, in.iyz, in.izz;
  return SpatialInertia{in.mass, Vector3::Zero(), rotational}.transformed(pose);
}

JointType to_type(const urdf::Joint& joint, bool spherical) {
  if (spherical) return JointType::kSpherical;
  switch (joint.type) {
    case urdf::Joint::PRISMATIC:
      return JointType::kPrismatic;
    case urdf::Joint::FLOATING:
      return JointType::kFloating;
    case urdf::Joint::PLANAR:
      return JointType::kPlanar;
    default:
      return JointType::kRevolute;
  }
}

/// Builds a RobotSpec from urdfdom's model and the values that urdfdom does not read.
class Converter {
 public:
  Converter(const std::filesystem::path& file, const UrdfOptions& options, const UrdfXml& xml)
      : file_(file), options_(options), xml_(xml) {}

  RobotSpec convert(const urdf::ModelInterface& model) {
    RobotSpec robot;
    robot.name = model.getName();
    robot.where = file_.string();
    notes_ = xml_.notes;
    load_meshes(model);
    for (const std::string& name : xml_.link_names) {
      const UrdfXml::Link& link = xml_.links.at(name);
      faults_.collect([&] {
        robot.links.push_back(make_link(same(model.getLink(name), "link", name, link.line), link));
      });
    }
    for (const std::string& name : xml_.joint_names) {
      const UrdfXml::Joint& joint = xml_.joints.at(name);
      faults_.collect([&] {
        robot.joints.push_back(
            make_joint(same(model.getJoint(name), "joint", name, joint.line), joint));
      });
    }
    if (options_.repair_joints) repair_joints(robot);
    // Report also the faults that ModelBuilder would find next.
    if (faults_.any())
      faults_.collect([&] { ModelBuilder().add_robot(robot, Base::kFixed, Pose()); });
    faults_.throw_if_any();
    note_dropped("effort", no_effort_);
    note_dropped("velocity", no_velocity_);
    robot.notes = std::move(notes_);
    return robot;
  }

 private:
  std::string at(int line) const { return fmt::format("{}:{}", file_.string(), line); }

  /// The object that urdfdom has under a name. @throws InputError if it has none: it changes names
  /// that are not UTF-8.
  template <class T>
  const T& same(const std::shared_ptr<T>& found, const char* kind, const std::string& name,
                int line) const {
    if (found == nullptr) {
      throw InputError(fmt::format(
          "{}: {} '{}': the name is not valid text; use letters, digits, '_' and '-', in UTF-8",
          at(line), kind, name));
    }
    return *found;
  }

  void load_meshes(const urdf::ModelInterface& model) {
    std::vector<HullCache::MeshFile> meshes;
    for (const auto& [name, link] : model.links_) {
      const auto extra = xml_.links.find(name);
      if (extra == xml_.links.end()) continue;
      for (std::size_t i = 0; i < link->collision_array.size(); ++i) {
        const urdf::Collision& collision = *link->collision_array[i];
        if (!collision.geometry || collision.geometry->type != urdf::Geometry::MESH) continue;
        const auto& mesh = static_cast<const urdf::Mesh&>(*collision.geometry);
        try {
          meshes.push_back(
              {find_mesh(mesh.filename, file_.parent_path(), options_.packages, "").file,
               to_vector(mesh.scale), kind_of(extra->second.collisions.at(i).convex)});
        } catch (const InputError&) {  // make_shape says where
        }
      }
    }
    cache_->load_ahead(meshes);
  }

  LinkSpec make_link(const urdf::Link& in, const UrdfXml::Link& extra) {
    LinkSpec link;
    link.name = in.name;
    link.where = at(extra.line);
    if (in.inertial) link.inertia = to_inertia(*in.inertial);
    link.inertia = link.inertia + extra.further_inertia;
    const std::string defect = options_.repair_inertias ? inertia_defect(link.inertia) : "";
    if (!defect.empty()) {
      link.inertia = nearest_physical(link.inertia);
      notes_.push_back({link.where + ": link '" + link.name + "'",
                        defect + "; replaced by the nearest possible"});
    }
    for (size_t i = 0; i < in.collision_array.size(); ++i) {
      const std::string where = fmt::format("{}: link '{}', collision {}", link.where, in.name, i);
      faults_.collect([&] {
        link.collisions.push_back(
            make_collision(*in.collision_array[i], extra.collisions.at(i), extra, where));
      });
    }
    return link;
  }

  LinkSpec::Collision make_collision(const urdf::Collision& in, const UrdfXml::Collision& surface,
                                     const UrdfXml::Link& link, const std::string& where) {
    LinkSpec::Collision out;
    out.name = in.name;
    out.X_LG = to_pose(in.origin);
    out.shape = make_shape(in, surface, where);
    out.material = surface.surface.over(link.surface.over(options_.default_material));
    return out;
  }

  Shape make_shape(const urdf::Collision& collision, const UrdfXml::Collision& extra,
                   const std::string& where) {
    Shape shape;
    if (!collision.geometry) throw InputError(where + ": <geometry> is missing");
    switch (collision.geometry->type) {
      case urdf::Geometry::SPHERE: {
        const auto& sphere = static_cast<const urdf::Sphere&>(*collision.geometry);
        shape.type = ShapeType::kSphere;
        shape.size = {sphere.radius, 0, 0};
        if (sphere.radius == 0.0) {
          shape.size[0] = kPointRadius;
          notes_.push_back({where, fmt::format("a sphere of radius 0, a contact point; its radius "
                                               "is taken as {} m",
                                               kPointRadius)});
        }
        break;
      }
      case urdf::Geometry::BOX: {
        const auto& box = static_cast<const urdf::Box&>(*collision.geometry);
        shape.type = ShapeType::kBox;
        shape.size = 0.5 * to_vector(box.dim);
        break;
      }
      case urdf::Geometry::CYLINDER: {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(*collision.geometry);
        shape.type = extra.capsule ? ShapeType::kCapsule : ShapeType::kCylinder;
        shape.size = {cylinder.radius, 0.5 * cylinder.length, 0};
        break;
      }
      case urdf::Geometry::MESH: {
        const auto& mesh = static_cast<const urdf::Mesh&>(*collision.geometry);
        shape.type = ShapeType::kConvexMesh;
        shape.mesh = hull(mesh.filename, to_vector(mesh.scale), extra.convex, where);
        break;
      }
    }
    return shape;
  }

  /// A mesh that the file declares convex collides as its hull.
  static std::optional<MeshCollision> kind_of(bool convex) {
    if (!convex) return {};
    return MeshCollision{MeshKind::kHull, 0.0, 1};
  }

  std::shared_ptr<const ConvexMesh> hull(const std::string& name, const Vector3& scale, bool convex,
                                         const std::string& where) {
    const std::tuple key(name, scale.x(), scale.y(), scale.z(), convex);
    const auto cached = hulls_.find(key);
    if (cached != hulls_.end()) return cached->second;
    const MeshPath path = find_mesh(name, file_.parent_path(), options_.packages, where);
    if (path.guessed) {
      notes_.push_back(
          {where, fmt::format("mesh '{}' is taken to be {}", name, path.file.string())});
    }
    std::shared_ptr<const ConvexMesh> mesh;
    try {
      mesh = cache_->load(path.file, scale, kind_of(convex));
    } catch (const InputError& error) {
      throw InputError(where + ": " + error.what());
    }
    const std::string note = hull_note(*mesh);
    if (!note.empty()) notes_.push_back({where, fmt::format("mesh '{}' {}", name, note)});
    hulls_.emplace(key, mesh);
    return mesh;
  }

  void repair_joints(RobotSpec& robot) {
    const auto one_axis = [](const JointSpec& j) { return !j.fixed && joint_nv(j.type) == 1; };
    for (JointSpec& joint : robot.joints) {
      const std::string where = joint.where + ": joint '" + joint.name + "'";
      if (joint.lower > joint.upper) {
        std::swap(joint.lower, joint.upper);
        notes_.push_back({where, fmt::format("its lower limit was above the upper one; exchanged: "
                                             "[{}, {}]",
                                             joint.lower, joint.upper)});
      }
      if (joint.mimic_master.empty()) continue;
      const auto master =
          std::find_if(robot.joints.begin(), robot.joints.end(),
                       [&](const JointSpec& j) { return j.name == joint.mimic_master; });
      if (master != robot.joints.end() && one_axis(*master) && one_axis(joint)) continue;
      notes_.push_back(
          {where,
           fmt::format("cannot follow joint '{}' ({}); it moves by itself", joint.mimic_master,
                       master == robot.joints.end() ? "which does not exist"
                                                    : "both must be revolute or prismatic")});
      joint.mimic_master.clear();
    }
  }

  /// Many files give effort="0" because the value is unknown; enforced, it would leave the robot
  /// limp.
  static void drop_if_not_positive(double& limit, const JointSpec& joint, std::string& dropped) {
    if (joint.fixed || !(limit <= 0.0)) return;
    limit = std::numeric_limits<double>::infinity();
    dropped += (dropped.empty() ? "'" : ", '") + joint.name + "'";
  }

  void note_dropped(const char* what, const std::string& joints) {
    if (joints.empty()) return;
    notes_.push_back({file_.string(), fmt::format("{0} limits of zero or less count as not given: "
                                                  "joint {1}; a scene may give {0}_limit",
                                                  what, joints)});
  }

  JointSpec make_joint(const urdf::Joint& in, const UrdfXml::Joint& extra) {
    JointSpec joint;
    joint.name = in.name;
    joint.where = at(extra.line);
    joint.fixed = in.type == urdf::Joint::FIXED;
    joint.type = to_type(in, extra.spherical);
    joint.parent = in.parent_link_name;
    joint.child = in.child_link_name;
    joint.X_PJ = to_pose(in.parent_to_joint_origin_transform);
    joint.axis = to_vector(in.axis);
    joint.armature = extra.armature;
    if (in.limits) {
      const bool one_axis = in.type == urdf::Joint::REVOLUTE || in.type == urdf::Joint::PRISMATIC;
      if (one_axis && extra.bounded) {
        joint.lower = in.limits->lower;
        joint.upper = in.limits->upper;
      }
      if (extra.effort_limited) joint.effort_limit = in.limits->effort;
      if (extra.velocity_limited) joint.velocity_limit = in.limits->velocity;
      drop_if_not_positive(joint.effort_limit, joint, no_effort_);
      drop_if_not_positive(joint.velocity_limit, joint, no_velocity_);
    }
    if (in.dynamics) {
      joint.damping = in.dynamics->damping;
      joint.dry_friction = in.dynamics->friction;
    }
    if (in.mimic) {
      joint.mimic_master = in.mimic->joint_name;
      joint.mimic_multiplier = in.mimic->multiplier;
      joint.mimic_offset = in.mimic->offset;
    }
    return joint;
  }

  const std::filesystem::path& file_;
  const UrdfOptions& options_;
  const UrdfXml& xml_;
  const std::shared_ptr<HullCache> cache_ =
      options_.hulls ? options_.hulls : std::make_shared<HullCache>();
  std::vector<Note> notes_;
  Faults faults_;
  std::string no_effort_, no_velocity_;  // joints whose limit is not positive
  std::map<std::tuple<std::string, double, double, double, bool>, std::shared_ptr<const ConvexMesh>>
      hulls_;
};

}  // namespace

RobotSpec load_urdf(const std::filesystem::path& file, const UrdfOptions& options) {
  const UrdfXml xml = read_urdf_xml(file);
  const urdf::ModelInterfaceSharedPtr model = parse(xml, file.string());
  return Converter(file, options, xml).convert(*model);
}

}  // namespace counterpoint
