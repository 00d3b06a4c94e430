#include "counterpoint/model/model_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/builder/robot_tree.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/model.h"

namespace counterpoint {
namespace {

/// Keeps the first of equal notes about a mesh, which many bodies may share.
void say_once_of_meshes(std::vector<Note>& notes) {
  std::set<std::string> said;
  std::erase_if(notes, [&](const Note& note) {
    return note.message.starts_with("mesh '") && !said.insert(note.message).second;
  });
}

/// Returns true if a link welded to the world represents the world itself: the root link "world" of
/// ROS and Gazebo, or a link without shapes and mass. The branches below it are then separate
/// assemblies.
bool stands_for_world(const LinkSpec& link, bool is_root) {
  const bool named = link.name.substr(link.name.rfind('/') + 1) == "world";
  return (is_root && named) || (link.collisions.empty() && link.inertia.mass == 0.0);
}

}  // namespace

RobotSpec object_of(const std::string& name, const Shape& shape, double mass,
                    const Material& material) {
  if (shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain ||
      shape.type == ShapeType::kConvexMesh)
    throw InputError(
        fmt::format("object '{}': a sphere, box, capsule or cylinder has the inertia of "
                    "its mass; describe others by their links",
                    name));
  RobotSpec object;
  object.name = name;
  LinkSpec link;
  link.name = "body";
  link.inertia = solid_inertia(shape, mass);
  link.collisions.push_back({"shape", Pose(), shape, material});
  object.links.push_back(link);
  return object;
}

ModelBuilder::ModelBuilder(const Vector3& gravity) {
  if (!gravity.allFinite()) throw InputError("gravity must be three finite numbers [m/s^2]");
  model_.gravity_ = gravity;
  model_.bodies_.emplace_back();
  model_.bodies_[0].parent = -1;
}

int ModelBuilder::add_robot(const RobotSpec& robot, Base base, const Pose& X_WL,
                            const std::string& prefix) {
  check_pose(X_WL, located_at(robot.where, "robot '" + robot.name + "', pose of the base"));
  const RobotTree tree = check_robot(robot);
  Placement placement{num_instances_++, prefix};
  for (const Note& note : robot.notes) model_.notes_.push_back(note);

  struct Pending {
    int link, body;
    Pose X_BL;
    int joint;     // joint for which a body must still be added, or -1
    int parent;    // frame of the parent link, or -1
    int assembly;  // assembly of the parent link; -1: starts a new one
  };
  const LinkSpec& root = robot.links[tree.root];
  std::vector<Pending> open;
  if (base == Base::kFixed) {
    open.push_back({tree.root, 0, X_WL, -1, -1, -1});
  } else {
    const int body = add_base(robot, root, base, placement, X_WL);
    open.push_back({tree.root, body, Pose(), -1, -1, -1});
  }
  // Depth first, children in file order, so that the bodies of every subtree are contiguous.
  while (!open.empty()) {
    Pending next = open.back();
    open.pop_back();
    if (next.joint >= 0) {
      const JointSpec& joint = robot.joints[next.joint];
      const bool has_axis =
          joint.type != JointType::kSpherical && joint.type != JointType::kFloating;
      const Matrix3 turn =
          has_axis ? rotation_z_to(joint.axis.normalized()) : Matrix3(Matrix3::Identity());
      next.body = add_body(joint, placement, next.body, next.X_BL * Pose{turn, Vector3::Zero()});
      next.X_BL = Pose{turn.transpose(), Vector3::Zero()};
    }
    const LinkSpec& link = robot.links[next.link];
    placement.assembly = next.assembly;
    if (next.assembly < 0 && next.body == 0 && stands_for_world(link, next.link == tree.root))
      placement.assembly = -1;
    else if (next.assembly < 0)
      placement.assembly = num_assemblies_++;
    const int frame = add_link(link, placement, next.body, next.X_BL, next.parent);
    const std::vector<int>& children = tree.children[next.link];
    for (auto it = children.rbegin(); it != children.rend(); ++it) {
      const JointSpec& joint = robot.joints[*it];
      const bool flies = !joint.fixed && joint.type == JointType::kFloating;
      open.push_back({tree.joint_child[*it], next.body, next.X_BL * joint.X_PJ,
                      joint.fixed ? -1 : *it, frame, flies ? -1 : placement.assembly});
    }
  }
  for (const JointSpec& joint : robot.joints) {
    if (joint.mimic_master.empty()) continue;
    model_.mimics_.push_back({joint_names_.at(prefix + joint.name),
                              joint_names_.at(prefix + joint.mimic_master), joint.mimic_multiplier,
                              joint.mimic_offset});
  }
  return placement.instance;
}

int ModelBuilder::add_link(const LinkSpec& link, const Placement& placement, int body,
                           const Pose& X_BL, int parent) {
  const std::string name = placement.prefix + link.name;
  const int frame = static_cast<int>(model_.frames_.size());
  take_name(frame_names_, name, frame, link.where, "link");
  model_.frames_.push_back({name, body, X_BL, parent, link.inertia});
  frame_geometries_.push_back(static_cast<int>(model_.geometries_.size()));
  add_collisions(link, placement, body, X_BL, frame);
  if (body == 0) return frame;
  if (link.gravity_compensation != 0.0)
    model_.gravity_compensations_.push_back(
        {body, X_BL * link.inertia.center, link.gravity_compensation * link.inertia.mass});
  if (link.drag.any()) model_.drags_.push_back({body, X_BL * link.inertia.center, link.drag});
  Body& moved = model_.bodies_[body];
  moved.inertia = moved.inertia + link.inertia.transformed(X_BL);
  const std::string defect = inertia_defect(link.inertia);
  if (defect.empty()) return frame;
  // A link without mass cannot be repaired.
  if (link.inertia.mass > 0.0 && defective_link_[body - 1].empty())
    defective_link_[body - 1] = link.name;
  model_.notes_.push_back(
      {located_at(link.where, "link '" + name + "'"), defect + "; used as they are"});
  return frame;
}

void ModelBuilder::add_collisions(const LinkSpec& link, const Placement& placement, int body,
                                  const Pose& X_BL, int frame) {
  size_t count = model_.geometries_.size() + link.collisions.size();
  for (const LinkSpec::Collision& collision : link.collisions)
    if (collision.shape.mesh) count += collision.shape.mesh->pieces.size();
  if (count > limits::kMaxGeometries) {
    throw InputError(located_at(link.where, fmt::format("more than {} geometries; make the scene "
                                                        "smaller (count, models)",
                                                        limits::kMaxGeometries)));
  }
  for (size_t i = 0; i < link.collisions.size(); ++i) {
    const LinkSpec::Collision& collision = link.collisions[i];
    const std::string stem = placement.prefix + link.name + "/";
    Geometry geometry;
    geometry.name = stem + (collision.name.empty() ? std::to_string(i) : collision.name);
    // Files may repeat a collision name within a link; its index makes it unique.
    if (geometry_names_.count(geometry.name) > 0) {
      geometry.name = stem + collision.name + ":" + std::to_string(i);
    }
    geometry.body = body;
    geometry.frame = frame;
    geometry.instance = placement.instance;
    geometry.assembly = placement.assembly;
    geometry.X_BG = X_BL * collision.X_LG;
    geometry.shape = collision.shape;
    geometry.material = collision.material;
    const ShapeType type = geometry.shape.type;
    if (body != 0 && (type == ShapeType::kPlane || type == ShapeType::kTerrain)) {
      throw InputError(located_at(
          link.where, fmt::format("link '{}': a {} cannot move; fix it to the world or use {}",
                                  link.name, type == ShapeType::kPlane ? "plane" : "terrain",
                                  type == ShapeType::kPlane ? "a box" : "convex meshes")));
    }
    append_geometry(std::move(geometry), link.where);
  }
}

void ModelBuilder::append_geometry(Geometry geometry, const std::string& where) {
  const int first = static_cast<int>(model_.geometries_.size());
  take_name(geometry_names_, geometry.name, first, where, "geometry");
  const auto hull = geometry.shape.mesh;
  if (!hull || hull->pieces.empty()) {
    model_.geometries_.push_back(std::move(geometry));
    return;
  }
  geometry.whole = first;
  const std::string name = geometry.name;
  for (size_t k = 0; k < hull->pieces.size(); ++k) {
    geometry.name = name + "#" + std::to_string(k);
    geometry.shape.mesh = hull->pieces[k];
    take_name(geometry_names_, geometry.name, first + static_cast<int>(k), where, "geometry");
    model_.geometries_.push_back(geometry);
  }
}

int ModelBuilder::add_environment(const std::string& name, const Shape& shape, const Pose& X_WG,
                                  const Material& material) {
  const std::string at = "environment '" + name + "'";
  if (name.empty()) throw InputError("environment: a geometry needs a name");
  check_shape(shape, at);
  check_pose(X_WG, at);
  check_material(material, at);
  const int index = static_cast<int>(model_.geometries_.size());
  Geometry geometry;
  geometry.name = name;
  geometry.X_BG = X_WG;
  geometry.shape = shape;
  geometry.material = material;
  append_geometry(std::move(geometry), "");
  return index;
}

void ModelBuilder::fill_inertia(double mass) {
  if (!(mass >= limits::kMinMass && mass <= limits::kMaxMass))
    throw InputError(
        fmt::format("inertia to fill in: the mass is {} kg; {:g} ... {:g} kg are taken", mass,
                    limits::kMinMass, limits::kMaxMass));
  filled_mass_ = mass;
}

/// Returns false if the body was filled before: more inertia does not help then.
bool ModelBuilder::fill_body(int body) {
  if (!(filled_mass_ > 0.0)) return false;
  const JointInfo& joint = model_.joints_[body - 1];
  const std::string at = located_at(joint_where_[body - 1], "link '" + joint.link + "'");
  const auto same = [&](const Note& note) { return note.where == at; };
  const std::string message = fmt::format(
      "has no inertia along the motion of joint '{}'; filled in: {:g} kg, a ball of the "
      "density of water about its origin",
      joint.name, filled_mass_);
  for (const Note& note : model_.notes_)
    if (same(note) && note.message == message) return false;
  constexpr double kPi = 3.14159265358979323846, kDensity = 1000.0;  // [kg/m^3]
  Shape ball{
      ShapeType::kSphere, {std::cbrt(0.75 * filled_mass_ / (kPi * kDensity)), 0, 0}, nullptr};
  Body& filled = model_.bodies_[body];
  filled.inertia = filled.inertia + solid_inertia(ball, filled_mass_);
  model_.notes_.push_back({at, message});
  return true;
}

void ModelBuilder::check_inertias() {
  for (int t = 0; t < model_.num_trees(); ++t) {
    const int coordinates = model_.trees_[t].v_end - model_.trees_[t].v_begin;
    const int root = model_.trees_[t].body_begin;
    if (coordinates > limits::kMaxTreeCoordinates) {
      throw InputError(located_at(
          joint_where_[root - 1],
          fmt::format(
              "the tree of joints from '{}' on has {} coordinates; at most {} are taken: cut "
              "it, and join the parts by closures",
              model_.joints_[root - 1].name, coordinates, limits::kMaxTreeCoordinates)));
    }
    const int k = find_coordinate_without_inertia(model_, t, model_.default_q_);
    if (k < 0) continue;
    const Tree& tree = model_.trees_[t];
    int body = tree.body_begin;
    for (int i = tree.body_begin; i < tree.body_end; ++i) {
      if (model_.bodies_[i].v_index - tree.v_begin <= k) body = i;
    }
    if (fill_body(body)) {
      --t;  // check the same tree again
      continue;
    }
    const JointInfo& joint = model_.joints_[body - 1];
    std::string message = fmt::format(
        "joint '{}' ({}) moves link '{}', which has no inertia along that motion, nor have the "
        "links it carries: the motion would be undefined. Give the link an <inertial> with mass "
        "and inertia, the joint an armature, or hold it by a fixed joint (a fixed base); the "
        "option "
        "fill_inertia (--fill-inertia 1e-3kg) goes on with a small mass there",
        joint.name, joint_type_name(model_.bodies_[body].joint_type), joint.link);
    for (int i = body; i < model_.bodies_[body].subtree_end; ++i) {
      if (defective_link_[i - 1].empty()) continue;
      message += fmt::format(
          ". The inertia of link '{}' is not that of a rigid body; the option repair_inertias "
          "replaces such by the nearest possible",
          defective_link_[i - 1]);
      break;
    }
    throw InputError(located_at(joint_where_[body - 1], message));
  }
}

namespace {

/// Pairs of geometries that no force can move relative to each other: their bodies move with
/// prescribed joints only, or one of them is fixed to the world.
std::vector<std::pair<int, int>> driven_pairs(const Model& model) {
  std::vector<char> driven(static_cast<size_t>(model.num_bodies()), 1);
  for (int i = 1; i < model.num_bodies(); ++i)
    driven[i] = model.joint(i - 1).prescribed && driven[model.body(i).parent];
  std::vector<int> of_driven;
  std::vector<std::pair<int, int>> pairs;
  const auto& geometries = model.geometries();
  for (int g = 0; g < static_cast<int>(geometries.size()); ++g)
    if (driven[geometries[g].body]) of_driven.push_back(g);
  if (std::count(driven.begin(), driven.end(), 1) == 1) return pairs;
  for (size_t j = 0; j < of_driven.size(); ++j)
    for (size_t i = 0; i < j; ++i)
      if (geometries[of_driven[i]].body != geometries[of_driven[j]].body)
        pairs.emplace_back(of_driven[i], of_driven[j]);
  return pairs;
}

}  // namespace

Model ModelBuilder::build() {
  model_.nq_ = static_cast<int>(default_q_.size());
  model_.nv_ = static_cast<int>(damping_.size());
  const auto to_eigen = [](const std::vector<double>& values) -> VectorX {
    return Eigen::Map<const VectorX>(values.data(), static_cast<Eigen::Index>(values.size()));
  };
  apply_mimics();
  set_servo_targets();
  model_.default_q_ = to_eigen(default_q_);
  model_.damping_ = to_eigen(damping_);
  model_.armature_ = to_eigen(armature_);
  model_.dry_friction_ = to_eigen(dry_friction_);
  model_.breakaway_friction_ = to_eigen(breakaway_friction_);
  model_.stribeck_speed_ = to_eigen(stribeck_speed_);
  for (int i = model_.num_bodies() - 1; i >= 0; --i) {
    Body& body = model_.bodies_[i];
    body.subtree_end = std::max(body.subtree_end, i + 1);
    if (i == 0) break;
    Body& parent = model_.bodies_[body.parent];
    parent.subtree_end = std::max(parent.subtree_end, body.subtree_end);
  }
  std::stable_sort(
      model_.gravity_compensations_.begin(), model_.gravity_compensations_.end(),
      [](const GravityCompensation& a, const GravityCompensation& b) { return a.body < b.body; });
  for (const auto& [i, j] : driven_pairs(model_))
    add_exclusion(i, j, "both move as prescribed, or not at all");
  sort_pairs();
  check_inertias();
  place_closures();
  place_tendons();
  place_internal_states();
  orient_terrains();
  say_once_of_meshes(model_.notes_);
  Model model = std::move(model_);
  *this = ModelBuilder(model.gravity_);
  return model;
}

}  // namespace counterpoint
