#include "counterpoint/model/scene/scene_models.h"

#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/model/mesh/mesh_mass.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene/scene_joints.h"
#include "counterpoint/model/scene/scene_shapes.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

/// Reads a free object that fills a closed mesh with uniform density, without its shape.
RobotSpec mesh_object(const YamlValue& in, const fs::path& folder, const std::string& name) {
  const YamlValue file = in.at("mesh");
  const Vector3 scale = in.has("scale") ? in.at("scale").vector3() : Vector3(1, 1, 1);
  const TriangleMesh mesh =
      located(file, [&] { return load_mesh(resolved(folder, file.text()), scale); });
  const MassProperties unit = mass_properties(mesh, MeshInertia::kExact);
  if (!is_closed(mesh) || !(unit.mass > 0.0))
    file.fail(
        "the mesh is not closed, so it has no volume whose inertia it could have: close it, or "
        "describe it in a URDF");
  const double density = in.at("mass").positive() / unit.mass;
  LinkSpec link;
  link.name = "body";
  link.inertia = {density * unit.mass, unit.center, density * unit.rotational};
  RobotSpec robot;
  robot.name = name;
  robot.links.push_back(link);
  return robot;
}

/// Reads a free object made of one shape of uniform density.
RobotSpec make_object(const YamlValue& in, const fs::path& folder, HullCache& hulls,
                      const Material& material) {
  const Shape shape = read_shape(in, folder, hulls);
  const std::string name = in.has("name") ? in.at("name").text() : "object";
  RobotSpec robot = shape.mesh ? mesh_object(in, folder, name)
                               : object_of(name, shape, in.at("mass").positive(), material);
  LinkSpec& link = robot.links.front();
  if (shape.mesh) {
    link.collisions.push_back({"shape", Pose(), shape, material});
    const std::string note = hull_note(*shape.mesh);
    if (!note.empty())
      robot.notes.push_back({in.where(), "mesh '" + in.at("mesh").text() + "' " + note});
  }
  robot.where = link.where = in.where();
  if (in.has("drag")) link.drag = read_drag(in.at("drag"));
  if (in.has("gravity_compensation"))
    link.gravity_compensation = in.at("gravity_compensation").number();
  for (const char* key : {"dynamics", "joint_types"}) {
    if (in.has(key)) in.at(key).fail("an object has no joints; this is for a model with a urdf");
  }
  return robot;
}

Base read_base(const YamlValue& in) {
  // Objects of one shape are movable by default.
  if (!in.has("base")) return in.has("urdf") ? Base::kFixed : Base::kFloating;
  const YamlValue value = in.at("base");
  if (value.is_text("fixed")) return Base::kFixed;
  if (value.is_text("floating")) return Base::kFloating;
  if (value.is_text("spherical")) return Base::kSpherical;
  value.fail("fixed, floating or spherical is expected");
}

/// Returns the path of a robot's file, given as a path or as package://NAME/... of a listed
/// package.
fs::path robot_file(const YamlValue& value, const fs::path& folder, const UrdfOptions& options) {
  const std::string text = value.text(), scheme = "package://";
  if (text.rfind(scheme, 0) != 0) return resolved(folder, text);
  const std::string rest = text.substr(scheme.size());
  const std::string package = rest.substr(0, rest.find('/'));
  const auto listed = options.packages.find(package);
  if (listed == options.packages.end() || package.size() == rest.size())
    value.fail(
        fmt::format("package '{0}' is not listed; expected package://NAME/FILE and where NAME "
                    "is: --package {0}=FOLDER, or packages: {{{0}: FOLDER}}",
                    package));
  return listed->second / rest.substr(package.size() + 1);
}

}  // namespace

RobotSpec ModelReader::read_robot(const YamlValue& in, ModelParts& parts) const {
  if (!in.has("urdf")) {
    return make_object(in, folder_, *urdf_options_.hulls,
                       read_material(in, urdf_options_.default_material));
  }
  for (const char* key : {"sphere", "box", "capsule", "cylinder", "mesh", "mass", "scale"}) {
    if (in.has(key)) in.at(key).fail("a model with a urdf takes its shapes and mass from it");
  }
  const YamlValue urdf = in.at("urdf");
  RobotSpec robot = located(urdf, [&] {
    const fs::path file = robot_file(urdf, folder_, urdf_options_);
    RobotSpec read = load_urdf(file, urdf_options_);
    parts = load_urdf_parts(file, read);
    return read;
  });
  for (LinkSpec& link : robot.links) {
    for (auto& collision : link.collisions) {
      collision.material = read_material(in, collision.material);
    }
  }
  if (in.has("joint_types")) read_joint_types(in.at("joint_types"), robot);
  if (in.has("dynamics")) read_dynamics(in.at("dynamics"), robot);
  if (in.has("drag")) read_link_drags(in.at("drag"), robot);
  if (in.has("gravity_compensation")) read_link_compensations(in.at("gravity_compensation"), robot);
  return robot;
}

Srdf ModelReader::read_srdf(const YamlValue& in) {
  if (!in.has("srdf")) return {};
  const YamlValue value = in.at("srdf");
  if (!in.has("urdf")) value.fail("an SRDF goes with a urdf");
  Srdf srdf = located(value, [&] { return load_srdf(resolved(folder_, value.text())); });
  for (const Note& note : srdf.notes) builder_.add_note(note);
  return srdf;
}

/// Refuses keys that an MJCF or SDF file defines itself: bases, materials, joint properties.
void ModelReader::expect_no_robot_keys(const YamlValue& in, const char* format) {
  const auto refuse = [&](const char* key) {
    if (in.has(key))
      in.at(key).fail(fmt::format("not for a model with an {}: its file says this", format));
  };
  for (const char* key : {"urdf", "srdf", "base", "prescribed", "velocity", "joint_types",
                          "dynamics", "drag", "gravity_compensation", "mass", "scale"})
    refuse(key);
  for (const char* key : kSurfaceKeys) refuse(key);
}

LeavingOptions ModelReader::leaving_options(const YamlValue& in) const {
  LeavingOptions options{urdf_options_, {}};
  if (!in.has("leave_out")) return options;
  for (const YamlValue& word : in.at("leave_out").list()) {
    const auto what = leave_out_from_name(word.text());
    if (!what) word.fail(leave_out_names() + " is expected");
    options.leave_out.insert(*what);
  }
  return options;
}

/// Adds a model in MuJoCo's format with its initial state; joint positions and velocities of the
/// scene file override it.
void ModelReader::read_mjcf(const YamlValue& in, bool only_one) {
  expect_no_robot_keys(in, "mjcf");
  const MjcfOptions options = leaving_options(in);
  const YamlValue file = in.at("mjcf");
  const MjcfModel model =
      located(file, [&] { return load_mjcf(robot_file(file, folder_, urdf_options_), options); });
  const std::string keyframe = in.has("keyframe") ? in.at("keyframe").text() : "";
  const Pose X_WL = read_pose(in);
  place(in, only_one, model.robot.name, X_WL, [&](const Pose& placed, const std::string& prefix) {
    const auto speeds =
        located(in, [&] { return add_mjcf(model, keyframe, placed, prefix, builder_); });
    for (const StartVelocity& start : speeds) velocities_.push_back({in, start.joint, start.v});
    read_start(in, Base::kFixed, 0, prefix);
  });
}

/// Adds a model or world in Gazebo's format; the scene's gravity and time step replace those of the
/// file.
void ModelReader::read_sdf(const YamlValue& in, bool only_one) {
  expect_no_robot_keys(in, "sdf");
  const YamlValue file = in.at("sdf");
  const SdfOptions options = leaving_options(in);
  const SdfModel model =
      located(file, [&] { return load_sdf(robot_file(file, folder_, urdf_options_), options); });
  place(in, only_one, model.name, read_pose(in),
        [&](const Pose& placed, const std::string& prefix) {
          located(in, [&] { add_sdf(model, placed, prefix, builder_); });
          read_start(in, Base::kFixed, 0, prefix);
        });
}

void ModelReader::read(const YamlValue& in, bool only_one) {
  in.expect_map({"urdf",        "mjcf",
                 "sdf",         "keyframe",
                 "leave_out",   "srdf",
                 "sphere",      "box",
                 "capsule",     "cylinder",
                 "mesh",        "scale",
                 "mass",        "name",
                 "base",        "prescribed",
                 "position",    "rpy",
                 "quaternion",  "joints",
                 "velocity",    "joint_velocities",
                 "joint_types", "dynamics",
                 "drag",        "gravity_compensation",
                 "count",       "spacing"},
                kSurfaceKeys);
  if (in.has("mjcf") && in.has("sdf")) in.at("sdf").fail("a model has one file: mjcf or sdf");
  if (in.has("mjcf")) return read_mjcf(in, only_one);
  if (in.has("keyframe")) in.at("keyframe").fail("this is for a model with an mjcf");
  if (in.has("sdf")) return read_sdf(in, only_one);
  if (in.has("leave_out")) in.at("leave_out").fail("this is for a model with an mjcf or sdf");
  ModelParts parts;
  RobotSpec robot = read_robot(in, parts);
  const Srdf srdf = read_srdf(in);
  const Base base = read_base(in);
  if (in.has("prescribed")) robot.prescribed_base = in.at("prescribed").boolean();
  if (robot.prescribed_base && base == Base::kFixed)
    in.at("prescribed").fail("a fixed base does not move; give base: floating");
  place(in, only_one, robot.name, read_pose(in),
        [&](const Pose& placed, const std::string& prefix) {
          const int first_joint = builder_.num_joints();
          located(in, [&] { return builder_.add_robot(robot, base, placed, prefix); });
          located(in, [&] { add_parts(parts, placed, prefix, builder_); });
          exclude_disabled_pairs(srdf, prefix, builder_);
          read_start(in, base, first_joint, prefix);
        });
}

/// Calls `add` for every copy of an entry, with its pose and prefix.
void ModelReader::place(const YamlValue& in, bool only_one, const std::string& robot_name,
                        const Pose& X_WL,
                        const std::function<void(const Pose&, const std::string&)>& add) {
  const int count = in.has("count") ? in.at("count").integer(1, 100000) : 1;
  const Vector3 spacing = in.has("spacing") ? in.at("spacing").vector3() : Vector3(0, 0, 0);
  if (count > 1 && spacing.isZero(0.0)) {
    in.at("count").fail("several copies need a spacing: [x, y, z] in metres");
  }
  const std::string name = in.has("name") ? in.at("name").text() : robot_name;
  for (int i = 0; i < count; ++i) {
    const bool bare = only_one && count == 1 && !in.has("name");
    const std::string prefix = bare ? "" : name + (count > 1 ? std::to_string(i) : "") + "/";
    add({X_WL.rotation, X_WL.translation + i * spacing}, prefix);
  }
}

void ModelReader::read_start(const YamlValue& in, Base base, int first_joint,
                             const std::string& prefix) {
  if (in.has("joints")) {
    for (const auto& [joint, value] : in.at("joints").entries()) {
      const std::vector<double> q = value.numbers();
      located(value, [&, &name = joint, &at = q] {
        builder_.set_default_position(
            prefix + name,
            Eigen::Map<const VectorX>(at.data(), static_cast<Eigen::Index>(at.size())));
      });
    }
  }
  if (in.has("joint_velocities")) {
    for (const auto& [joint, value] : in.at("joint_velocities").entries()) {
      velocities_.push_back({value, prefix + joint, value.numbers()});
    }
  }
  if (in.has("velocity"))
    read_base_velocity(in.at("velocity"), base, builder_.joint_name(first_joint));
}

void ModelReader::read_base_velocity(const YamlValue& in, Base base, const std::string& joint) {
  if (base == Base::kFixed) in.fail("a fixed base cannot move; give base: floating");
  in.expect_map({"linear", "angular"});
  const auto read = [&](const char* key) {
    return in.has(key) ? in.at(key).vector3() : Vector3(Vector3::Zero());
  };
  const Vector3 linear = read("linear"), angular = read("angular");
  std::vector<double> numbers(angular.begin(), angular.end());
  if (base == Base::kFloating) numbers.insert(numbers.begin(), linear.begin(), linear.end());
  if (base == Base::kSpherical && in.has("linear"))
    in.at("linear").fail("a base on a ball joint turns about its origin; give angular only");
  velocities_.push_back({in, joint, numbers});
}

VectorX ModelReader::start_velocities(const Model& model) const {
  VectorX v = VectorX::Zero(model.nv());
  for (const Velocity& velocity : velocities_) {
    const int joint = model.find_joint(velocity.joint);
    if (joint < 0) velocity.value.fail(fmt::format("there is no joint '{}'", velocity.joint));
    const Body& body = model.body(joint + 1);
    const int nv = joint_nv(body.joint_type);
    if (static_cast<int>(velocity.numbers.size()) != nv) {
      velocity.value.fail(fmt::format("joint '{}' is {} and takes {} velocities, not {}",
                                      velocity.joint, joint_type_name(body.joint_type), nv,
                                      velocity.numbers.size()));
    }
    std::copy_n(velocity.numbers.begin(), nv, v.data() + body.v_index);
  }
  // At most as many passes as the longest chain of mimics has joints.
  bool changed = true;
  for (size_t pass = 0; changed && pass < model.mimics().size(); ++pass) {
    changed = false;
    for (const Mimic& mimic : model.mimics()) {
      double& speed = v[model.body(mimic.joint + 1).v_index];
      const double follows = mimic.multiplier * v[model.body(mimic.master + 1).v_index];
      changed = changed || speed != follows;
      speed = follows;
    }
  }
  if (v.allFinite()) return v;
  throw InputError(
      "a joint that follows another would start with a speed that is not finite; give a "
      "smaller multiplier or speed");
}

}  // namespace counterpoint
