#include "counterpoint/model/model_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/builder/robot_tree.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

RobotSpec object_of(const std::string& name, const Shape& shape, double mass,
                    const Material& material) {
  if (shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain ||
      shape.type == ShapeType::kConvexMesh)
    throw InputError(fmt::format("object '{}': a sphere, box, capsule or cylinder has the inertia of "
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
  const Placement placement{num_instances_++, prefix};
  for (const Note& note : robot.notes) model_.notes_.push_back(note);

  struct Pending {
    int link, body;
    Pose X_BL;
    int joint;  // still to be made into a body, or -1
  };
  const LinkSpec& root = robot.links[tree.root];
  std::vector<Pending> open;
  if (base == Base::kFixed) {
    open.push_back({tree.root, 0, X_WL, -1});
  } else {
    const int body = add_base(robot, root, base, placement, X_WL);
    open.push_back({tree.root, body, Pose(), -1});
  }
  // Depth first, children in file order: bodies of every subtree come out contiguous.
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
    add_link(robot.links[next.link], placement, next.body, next.X_BL);
    const std::vector<int>& children = tree.children[next.link];
    for (auto it = children.rbegin(); it != children.rend(); ++it) {
      const JointSpec& joint = robot.joints[*it];
      open.push_back(
          {tree.joint_child[*it], next.body, next.X_BL * joint.X_PJ, joint.fixed ? -1 : *it});
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

void ModelBuilder::add_link(const LinkSpec& link, const Placement& placement, int body,
                            const Pose& X_BL) {
  const std::string name = placement.prefix + link.name;
  const int frame = static_cast<int>(model_.frames_.size());
  take_name(frame_names_, name, frame, link.where, "link");
  model_.frames_.push_back({name, body, X_BL});
  frame_geometries_.push_back(static_cast<int>(model_.geometries_.size()));
  add_collisions(link, placement, body, X_BL, frame);
  if (body == 0) return;
  if (link.gravity_compensation != 0.0)
    model_.gravity_compensations_.push_back(
        {body, X_BL * link.inertia.center, link.gravity_compensation * link.inertia.mass});
  if (link.drag.any()) model_.drags_.push_back({body, X_BL * link.inertia.center, link.drag});
  Body& moved = model_.bodies_[body];
  moved.inertia = moved.inertia + link.inertia.transformed(X_BL);
  const std::string defect = inertia_defect(link.inertia);
  if (defect.empty()) return;
  // Without mass there is nothing to repair.
  if (link.inertia.mass > 0.0 && defective_link_[body - 1].empty())
    defective_link_[body - 1] = link.name;
  model_.notes_.push_back(
      {located_at(link.where, "link '" + name + "'"), defect + "; used as they are"});
}

void ModelBuilder::add_collisions(const LinkSpec& link, const Placement& placement, int body,
                                  const Pose& X_BL, int frame) {
  if (model_.geometries_.size() + link.collisions.size() > limits::kMaxGeometries) {
    throw InputError(located_at(link.where, fmt::format("more than {} geometries; make the scene "
                                                        "smaller (count, models)",
                                                        limits::kMaxGeometries)));
  }
  for (size_t i = 0; i < link.collisions.size(); ++i) {
    const LinkSpec::Collision& collision = link.collisions[i];
    const std::string stem = placement.prefix + link.name + "/";
    Geometry geometry;
    geometry.name = stem + (collision.name.empty() ? std::to_string(i) : collision.name);
    // Files repeat collision names within a link; the number tells them apart.
    if (geometry_names_.count(geometry.name) > 0) {
      geometry.name = stem + collision.name + ":" + std::to_string(i);
    }
    geometry.body = body;
    geometry.frame = frame;
    geometry.instance = placement.instance;
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
    take_name(geometry_names_, geometry.name, static_cast<int>(model_.geometries_.size()),
              link.where, "geometry");
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
  take_name(geometry_names_, name, index, "", "geometry");
  Geometry geometry;
  geometry.name = name;
  geometry.X_BG = X_WG;
  geometry.shape = shape;
  geometry.material = material;
  model_.geometries_.push_back(geometry);
  return index;
}

std::vector<int> ModelBuilder::geometries_named(const std::string& name) const {
  std::vector<int> found;
  const auto geometry = geometry_names_.find(name);
  if (geometry != geometry_names_.end()) found.push_back(geometry->second);
  const auto frame = frame_names_.find(name);
  if (frame != frame_names_.end()) {
    // Those of a link were added together.
    const auto& all = model_.geometries_;
    for (int i = frame_geometries_[frame->second];
         i < static_cast<int>(all.size()) && all[i].frame == frame->second; ++i) {
      found.push_back(i);
    }
  }
  if (geometry == geometry_names_.end() && frame == frame_names_.end()) {
    throw InputError(fmt::format("there is no geometry or link '{}'; links: {}; geometries: {}",
                                 name, listed(frame_names_), listed(geometry_names_)));
  }
  return found;
}

void ModelBuilder::exclude_pair(const std::string& geometry_or_link_a,
                                const std::string& geometry_or_link_b,
                                const std::string& reason) {
  const std::vector<int> side_b = geometries_named(geometry_or_link_b);
  for (const int a : geometries_named(geometry_or_link_a)) {
    for (const int b : side_b) {
      if (a != b) add_exclusion(a, b, reason);
    }
  }
}

void ModelBuilder::add_exclusion(int a, int b, const std::string& reason) {
  if (model_.excluded_pairs_.size() == limits::kMaxExclusions) {
    throw InputError(fmt::format("more than {} pairs of geometries are excluded; use fewer geometries "
                                 "or smaller groups",
                                 limits::kMaxExclusions));
  }
  model_.excluded_pairs_.push_back(std::minmax(a, b));
  model_.exclusion_reasons_.push_back(reason);
}

/// Ascending, each pair once, with the reason that was given first.
void ModelBuilder::sort_exclusions() {
  std::map<std::pair<int, int>, std::string> sorted;
  for (size_t i = 0; i < model_.excluded_pairs_.size(); ++i) {
    sorted.emplace(model_.excluded_pairs_[i], model_.exclusion_reasons_[i]);
  }
  model_.excluded_pairs_.clear();
  model_.exclusion_reasons_.clear();
  for (auto& [pair, reason] : sorted) {
    model_.excluded_pairs_.push_back(pair);
    model_.exclusion_reasons_.push_back(std::move(reason));
  }
}

void ModelBuilder::set_pair_surface(const std::string& geometry_or_link_a,
                                    const std::string& geometry_or_link_b,
                                    const PairSurface& surface) {
  const std::vector<int> side_b = geometries_named(geometry_or_link_b);
  for (const int a : geometries_named(geometry_or_link_a)) {
    for (const int b : side_b) {
      if (a == b) continue;
      const auto& all = model_.geometries_;
      Material m = combine_materials(all[a].material, all[b].material);
      m.friction = surface.friction.value_or(m.friction);
      m.restitution = surface.restitution.value_or(m.restitution);
      m.torsional_friction = surface.torsional_friction.value_or(m.torsional_friction);
      m.rolling_friction = surface.rolling_friction.value_or(m.rolling_friction);
      check_material(m, fmt::format("pair '{}', '{}'", all[a].name, all[b].name));
      if (model_.pair_materials_.size() == limits::kMaxExclusions) {
        throw InputError(fmt::format("more than {} pairs of geometries have surface values of their "
                                     "own; use fewer geometries or smaller groups",
                                     limits::kMaxExclusions));
      }
      model_.pair_materials_.push_back({std::min(a, b), std::max(a, b), m});
    }
  }
}

/// Ascending, each pair once, as it was given last.
void ModelBuilder::sort_pair_materials() {
  std::map<std::pair<int, int>, Material> sorted;
  for (const PairMaterial& p : model_.pair_materials_)
    sorted.insert_or_assign({p.geometry_a, p.geometry_b}, p.material);
  model_.pair_materials_.clear();
  for (const auto& [pair, material] : sorted)
    model_.pair_materials_.push_back({pair.first, pair.second, material});
}

void ModelBuilder::fill_inertia(double mass) {
  if (!(mass >= limits::kMinMass && mass <= limits::kMaxMass))
    throw InputError(fmt::format("inertia to fill in: the mass is {} kg; {:g} ... {:g} kg are taken",
                                 mass, limits::kMinMass, limits::kMaxMass));
  filled_mass_ = mass;
}

/// False if it was filled before: then nothing helps.
bool ModelBuilder::fill_body(int body) {
  if (!(filled_mass_ > 0.0)) return false;
  const JointInfo& joint = model_.joints_[body - 1];
  const std::string at = located_at(joint_where_[body - 1], "link '" + joint.link + "'");
  const auto same = [&](const Note& note) { return note.where == at; };
  const std::string message =
      fmt::format("has no inertia along the motion of joint '{}'; filled in: {:g} kg, a ball of the "
                  "density of water about its origin",
                  joint.name, filled_mass_);
  for (const Note& note : model_.notes_)
    if (same(note) && note.message == message) return false;
  constexpr double kPi = 3.14159265358979323846, kDensity = 1000.0;  // [kg/m^3]
  Shape ball{ShapeType::kSphere, {std::cbrt(0.75 * filled_mass_ / (kPi * kDensity)), 0, 0}, nullptr};
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
          fmt::format("the tree of joints from '{}' on has {} coordinates; at most {} are taken: cut "
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
      --t;  // the same tree again
      continue;
    }
    const JointInfo& joint = model_.joints_[body - 1];
    std::string message = fmt::format(
        "joint '{}' ({}) moves link '{}', which has no inertia along that motion, nor have the "
        "links it carries: the motion would be undefined. Give the link an <inertial> with mass "
        "and inertia, the joint an armature, or hold it by a fixed joint (a fixed base); the option "
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
  sort_exclusions();
  sort_pair_materials();
  check_inertias();
  place_closures();
  Model model = std::move(model_);
  *this = ModelBuilder(model.gravity_);
  return model;
}

}  // namespace counterpoint
