#include "counterpoint/model/model_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/model/inertia.h"
#include "counterpoint/model/robot_tree.h"

namespace counterpoint {
namespace {

std::string located(const std::string& where, const std::string& what) {
  return where.empty() ? what : where + ": " + what;
}

/// The default of a joint: zero, or the limit nearest to it; quaternions are the identity.
std::vector<double> default_coordinates(const JointInfo& joint, JointType type) {
  std::vector<double> q(joint_nq(type), 0.0);
  if (type == JointType::kSpherical) q[0] = 1.0;
  if (type == JointType::kFloating) q[3] = 1.0;
  if (q.size() == 1) q[0] = std::clamp(0.0, joint.lower, joint.upper);
  return q;
}

/// "a, b, c, ... (12 in all)" for messages.
template <typename Map>
std::string listed(const Map& names) {
  constexpr size_t kShown = 12;
  std::string list;
  size_t n = 0;
  for (const auto& [name, index] : names) {
    if (n++ == kShown) return fmt::format("{}, ... ({} in all)", list, names.size());
    list += (list.empty() ? "'" : ", '") + name + "'";
  }
  return list.empty() ? "none" : list;
}

void take_name(std::map<std::string, int>& names, const std::string& name, int index,
               const std::string& where, const char* kind) {
  if (names.emplace(name, index).second) return;
  throw InputError(located(
      where, fmt::format("there is already a {} named '{}'; give each model of a scene its own "
                         "name, or rename it",
                         kind, name)));
}

}  // namespace

struct ModelBuilder::Placement {
  int instance = 0;
  std::string prefix;
};

ModelBuilder::ModelBuilder(const Vector3& gravity) {
  if (!gravity.allFinite()) throw InputError("gravity must be three finite numbers [m/s^2]");
  model_.gravity_ = gravity;
  model_.bodies_.emplace_back();
  model_.bodies_[0].parent = -1;
}

int ModelBuilder::add_robot(const RobotSpec& robot, Base base, const Pose& X_WL,
                            const std::string& prefix) {
  check_pose(X_WL, located(robot.where, "robot '" + robot.name + "', pose of the base"));
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
    JointSpec joint;
    joint.type = JointType::kFloating;
    joint.name = root.name;
    joint.child = root.name;
    joint.where = root.where;
    for (const JointSpec& other : robot.joints) {
      // A file may name a joint like its root link; names of moving joints must differ.
      if (other.name == joint.name) joint.name = root.name + "_base";
    }
    const int body = add_body(joint, placement, 0, Pose());
    const Quaternion orientation(X_WL.rotation);
    const int q_index = model_.bodies_[body].q_index;
    for (int i = 0; i < 3; ++i) default_q_[q_index + i] = X_WL.translation[i];
    default_q_[q_index + 3] = orientation.w();
    for (int i = 0; i < 3; ++i) default_q_[q_index + 4 + i] = orientation.vec()[i];
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

int ModelBuilder::add_body(const JointSpec& joint, const Placement& placement, int parent,
                           const Pose& X_PJ) {
  const int index = model_.num_bodies();
  Body body;
  body.parent = parent;
  body.joint_type = joint.type;
  body.q_index = static_cast<int>(default_q_.size());
  body.v_index = static_cast<int>(damping_.size());
  body.X_PJ = X_PJ;
  if (parent == 0) model_.trees_.push_back({index, index, body.v_index, body.v_index});
  body.tree = model_.num_trees() - 1;

  JointInfo info;
  info.name = placement.prefix + joint.name;
  info.link = placement.prefix + joint.child;
  const int nv = joint_nv(joint.type);
  if (nv == 1) {
    info.lower = joint.lower;
    info.upper = joint.upper;
  }
  info.effort_limit = joint.effort_limit;
  info.velocity_limit = joint.velocity_limit;
  info.actuated = joint.type != JointType::kFloating;
  take_name(joint_names_, info.name, index - 1, joint.where, "joint");

  const std::vector<double> q = default_coordinates(info, joint.type);
  if (nv == 1 && q[0] != 0.0) {
    model_.notes_.push_back({located(joint.where, "joint '" + info.name + "'"),
                             fmt::format("zero lies outside its limits [{}, {}]; it starts at {}",
                                         info.lower, info.upper, q[0])});
  }
  default_q_.insert(default_q_.end(), q.begin(), q.end());
  damping_.insert(damping_.end(), nv, joint.damping);
  armature_.insert(armature_.end(), nv, joint.armature);
  dry_friction_.insert(dry_friction_.end(), nv, joint.dry_friction);
  position_given_.push_back(0);
  joint_where_.push_back(joint.where);
  defective_link_.emplace_back();
  Tree& tree = model_.trees_.back();
  tree.body_end = index + 1;
  tree.v_end = body.v_index + nv;
  model_.bodies_.push_back(body);
  model_.joints_.push_back(info);
  return index;
}

void ModelBuilder::add_link(const LinkSpec& link, const Placement& placement, int body,
                            const Pose& X_BL) {
  const std::string name = placement.prefix + link.name;
  const int frame = static_cast<int>(model_.frames_.size());
  take_name(frame_names_, name, frame, link.where, "link");
  model_.frames_.push_back({name, body, X_BL});
  add_collisions(link, placement, body, X_BL, frame);
  if (body == 0) return;
  Body& moved = model_.bodies_[body];
  moved.inertia = moved.inertia + link.inertia.transformed(X_BL);
  const std::string defect = inertia_defect(link.inertia);
  if (defect.empty()) return;
  // Without mass there is nothing to repair.
  if (link.inertia.mass > 0.0 && defective_link_[body - 1].empty())
    defective_link_[body - 1] = link.name;
  model_.notes_.push_back(
      {located(link.where, "link '" + name + "'"), defect + "; used as they are"});
}

void ModelBuilder::add_collisions(const LinkSpec& link, const Placement& placement, int body,
                                  const Pose& X_BL, int frame) {
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
      throw InputError(located(
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

void ModelBuilder::set_default_position(const std::string& joint, const VectorX& q) {
  const auto found = joint_names_.find(joint);
  if (found == joint_names_.end()) {
    throw InputError(
        fmt::format("there is no joint '{}'; joints: {}", joint, listed(joint_names_)));
  }
  const Body& body = model_.bodies_[found->second + 1];
  const int nq = joint_nq(body.joint_type);
  if (q.size() != nq) {
    throw InputError(fmt::format("joint '{}' is {} and takes {} numbers, not {}", joint,
                                 joint_type_name(body.joint_type), nq, q.size()));
  }
  if (!q.allFinite()) {
    throw InputError(fmt::format("joint '{}': its position must be finite numbers", joint));
  }
  VectorX value = q;
  if (body.joint_type == JointType::kSpherical || body.joint_type == JointType::kFloating) {
    const double norm = value.tail<4>().norm();
    if (norm < 1e-9) {
      throw InputError(fmt::format("joint '{}': a quaternion (w x y z) cannot be zero", joint));
    }
    value.tail<4>() /= norm;
  }
  std::copy_n(value.data(), nq, default_q_.begin() + body.q_index);
  position_given_[found->second] = 1;
}

std::vector<int> ModelBuilder::geometries_named(const std::string& name) const {
  std::vector<int> found;
  const auto geometry = geometry_names_.find(name);
  if (geometry != geometry_names_.end()) found.push_back(geometry->second);
  const auto frame = frame_names_.find(name);
  if (frame != frame_names_.end()) {
    for (size_t i = 0; i < model_.geometries_.size(); ++i) {
      if (model_.geometries_[i].frame == frame->second) found.push_back(static_cast<int>(i));
    }
  }
  if (geometry == geometry_names_.end() && frame == frame_names_.end()) {
    throw InputError(fmt::format("there is no geometry or link '{}'; links: {}; geometries: {}",
                                 name, listed(frame_names_), listed(geometry_names_)));
  }
  return found;
}

void ModelBuilder::exclude_pair(const std::string& geometry_or_link_a,
                                const std::string& geometry_or_link_b) {
  const std::vector<int> side_b = geometries_named(geometry_or_link_b);
  for (const int a : geometries_named(geometry_or_link_a)) {
    for (const int b : side_b) {
      if (a != b) model_.excluded_pairs_.push_back(std::minmax(a, b));
    }
  }
}

void ModelBuilder::apply_mimics() {
  // As many passes as the longest chain of mimics can have links; check_robot excluded loops.
  for (size_t pass = 0; pass < model_.mimics_.size(); ++pass) {
    for (const Mimic& mimic : model_.mimics_) {
      const double master = default_q_[model_.bodies_[mimic.master + 1].q_index];
      default_q_[model_.bodies_[mimic.joint + 1].q_index] =
          mimic.multiplier * master + mimic.offset;
    }
  }
  for (const Mimic& mimic : model_.mimics_) {
    if (!position_given_[mimic.joint]) continue;
    model_.notes_.push_back(
        {located(joint_where_[mimic.joint], "joint '" + model_.joints_[mimic.joint].name + "'"),
         "mimics joint '" + model_.joints_[mimic.master].name +
             "'; the position given for it is replaced by the master's"});
  }
}

void ModelBuilder::check_inertias() const {
  for (int t = 0; t < model_.num_trees(); ++t) {
    const int k = find_coordinate_without_inertia(model_, t, model_.default_q_);
    if (k < 0) continue;
    const Tree& tree = model_.trees_[t];
    int body = tree.body_begin;
    for (int i = tree.body_begin; i < tree.body_end; ++i) {
      if (model_.bodies_[i].v_index - tree.v_begin <= k) body = i;
    }
    const JointInfo& joint = model_.joints_[body - 1];
    std::string message = fmt::format(
        "joint '{}' ({}) moves link '{}', which has no inertia along that motion, nor have the "
        "links it carries: the motion would be undefined. Give the link an <inertial> with mass "
        "and inertia, the joint an armature, or hold it by a fixed joint (a fixed base)",
        joint.name, joint_type_name(model_.bodies_[body].joint_type), joint.link);
    for (int i = body; i < model_.bodies_[body].subtree_end; ++i) {
      if (defective_link_[i - 1].empty()) continue;
      message += fmt::format(
          ". The inertia of link '{}' is not that of a rigid body; the option repair_inertias "
          "replaces such by the nearest possible",
          defective_link_[i - 1]);
      break;
    }
    throw InputError(located(joint_where_[body - 1], message));
  }
}

Model ModelBuilder::build() {
  model_.nq_ = static_cast<int>(default_q_.size());
  model_.nv_ = static_cast<int>(damping_.size());
  const auto to_eigen = [](const std::vector<double>& values) -> VectorX {
    return Eigen::Map<const VectorX>(values.data(), static_cast<Eigen::Index>(values.size()));
  };
  apply_mimics();
  model_.default_q_ = to_eigen(default_q_);
  model_.damping_ = to_eigen(damping_);
  model_.armature_ = to_eigen(armature_);
  model_.dry_friction_ = to_eigen(dry_friction_);
  model_.has_damping_ = (model_.damping_.array() > 0.0).any();
  for (int i = model_.num_bodies() - 1; i >= 0; --i) {
    Body& body = model_.bodies_[i];
    body.subtree_end = std::max(body.subtree_end, i + 1);
    if (i == 0) break;
    Body& parent = model_.bodies_[body.parent];
    parent.subtree_end = std::max(parent.subtree_end, body.subtree_end);
  }
  std::sort(model_.excluded_pairs_.begin(), model_.excluded_pairs_.end());
  model_.excluded_pairs_.erase(
      std::unique(model_.excluded_pairs_.begin(), model_.excluded_pairs_.end()),
      model_.excluded_pairs_.end());
  check_inertias();
  place_closures();
  Model model = std::move(model_);
  *this = ModelBuilder(model.gravity_);
  return model;
}

}  // namespace counterpoint
