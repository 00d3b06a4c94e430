#include "counterpoint/model/builder/robot_tree.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

std::string link_at(const LinkSpec& link) {
  return link.where.empty() ? fmt::format("link '{}'", link.name)
                            : fmt::format("{}: link '{}'", link.where, link.name);
}

std::string joint_at(const JointSpec& joint) {
  return joint.where.empty() ? fmt::format("joint '{}'", joint.name)
                             : fmt::format("{}: joint '{}'", joint.where, joint.name);
}

void check_nonnegative(double value, const char* what, const std::string& at) {
  if (std::isfinite(value) && value >= 0.0) return;
  throw InputError(
      fmt::format("{}: {} is {}; it must be finite and not negative", at, what, value));
}

void check_link(const LinkSpec& link) {
  const std::string at = link_at(link);
  if (link.name.empty()) throw InputError(at + ": a link needs a name");
  const SpatialInertia& inertia = link.inertia;
  if (!std::isfinite(inertia.mass) || !inertia.center.allFinite() ||
      !inertia.rotational.allFinite()) {
    throw InputError(at + ": mass, centre of mass and inertia must be finite numbers");
  }
  if (inertia.mass < 0.0) {
    throw InputError(
        fmt::format("{}: mass is {} kg; give a mass that is zero or positive", at, inertia.mass));
  }
  if (inertia.mass > limits::kMaxMass || (inertia.mass > 0.0 && inertia.mass < limits::kMinMass) ||
      inertia.rotational.cwiseAbs().maxCoeff() > limits::kMaxMass ||
      inertia.center.cwiseAbs().maxCoeff() > limits::kMaxLength) {
    throw InputError(
        fmt::format("{}: mass {:g} kg, moments up to {:g} kg m^2, centre up to {:g} m "
                    "away; masses of {:g} ... {:g} kg are taken, moments up to {:g} and "
                    "{:g} m (are the units right?)",
                    at, inertia.mass, inertia.rotational.cwiseAbs().maxCoeff(),
                    inertia.center.cwiseAbs().maxCoeff(), limits::kMinMass, limits::kMaxMass,
                    limits::kMaxMass, limits::kMaxLength));
  }
  if (!(std::abs(link.gravity_compensation * link.inertia.mass) <= limits::kMaxMass))
    throw InputError(
        fmt::format("{}: gravity_compensation {:g}; a finite share of the weight is expected "
                    "(1: all of it)",
                    at, link.gravity_compensation));
  check_nonnegative(link.drag.linear, "linear drag", at);
  check_nonnegative(link.drag.quadratic, "quadratic drag", at);
  check_nonnegative(link.drag.angular, "angular drag", at);
  check_nonnegative(link.drag.angular_quadratic, "quadratic angular drag", at);
  for (const auto& collision : link.collisions) {
    const std::string where = at + ", collision '" + collision.name + "'";
    check_shape(collision.shape, where);
    check_pose(collision.X_LG, where);
    check_material(collision.material, where);
  }
}

void check_limits(const JointSpec& joint, const std::string& at) {
  if (std::isnan(joint.lower) || std::isnan(joint.upper) || std::isnan(joint.effort_limit) ||
      std::isnan(joint.velocity_limit)) {
    throw InputError(at + ": a limit is not a number");
  }
  if (joint.lower > joint.upper) {
    throw InputError(
        fmt::format("{}: lower limit {} is above upper limit {}; swap them, or "
                    "let repair_joints (--repair-joints) do it",
                    at, joint.lower, joint.upper));
  }
  if (joint.effort_limit < 0.0) {
    throw InputError(
        fmt::format("{}: effort limit is {}; it must not be negative", at, joint.effort_limit));
  }
  if (joint.velocity_limit <= 0.0) {
    throw InputError(
        fmt::format("{}: velocity limit is {}; it must be positive", at, joint.velocity_limit));
  }
}

/// Checks spring and servo; both need a joint of one coordinate.
void check_joint_forces(const JointSpec& joint, const std::string& at) {
  check_nonnegative(joint.stiffness, "stiffness", at);
  check_nonnegative(joint.servo.stiffness, "stiffness of the servo", at);
  check_nonnegative(joint.servo.damping, "damping of the servo", at);
  if (!std::isfinite(joint.reference) || !std::isfinite(joint.servo.position.value_or(0.0)) ||
      !std::isfinite(joint.servo.velocity)) {
    throw InputError(at + ": reference and targets must be finite numbers");
  }
  const bool spring = joint.stiffness > 0.0;
  const bool servo = joint.servo.stiffness > 0.0 || joint.servo.damping > 0.0;
  if (!spring && !servo) return;
  if (joint_nv(joint.type) != 1) {
    throw InputError(fmt::format("{}: it is {}; a {} needs a revolute or prismatic joint", at,
                                 joint_type_name(joint.type), spring ? "spring" : "servo"));
  }
  if (servo && !joint.mimic_master.empty()) {
    throw InputError(
        fmt::format("{}: it follows joint '{}'; give that one the servo", at, joint.mimic_master));
  }
}

void check_stribeck_speed(double speed, const char* unit, const std::string& at) {
  if (!(speed > 0.0) || !std::isfinite(speed))
    throw InputError(
        fmt::format("{}: stribeck_speed is {} {}; it must be positive", at, speed, unit));
}

void check_breakaway(const JointSpec& joint, const std::string& at) {
  check_nonnegative(joint.breakaway_friction, "breakaway friction", at);
  if (joint.breakaway_friction != 0.0 && joint.breakaway_friction < joint.dry_friction)
    throw InputError(
        fmt::format("{}: breakaway_friction is {:g}; expected at least the dry_friction {:g}", at,
                    joint.breakaway_friction, joint.dry_friction));
  check_stribeck_speed(joint.stribeck_speed, "rad/s or m/s", at);
}

void check_joint(const JointSpec& joint) {
  const std::string at = joint_at(joint);
  if (joint.name.empty()) throw InputError(at + ": a joint needs a name");
  check_pose(joint.X_PJ, at);
  if (joint.fixed) return;
  const bool has_axis = joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic ||
                        joint.type == JointType::kPlanar;
  if (has_axis && !joint.axis.allFinite()) throw InputError(at + ": the axis is not finite");
  if (has_axis && joint.axis.norm() < 1e-9) {
    throw InputError(at + ": the axis is zero; give a direction, <axis xyz=\"0 0 1\"/> say");
  }
  check_limits(joint, at);
  check_nonnegative(joint.damping, "damping", at);
  check_nonnegative(joint.dry_friction, "friction", at);
  check_nonnegative(joint.armature, "armature", at);
  check_breakaway(joint, at);
  check_joint_forces(joint, at);
}

void check_mimic(const RobotSpec& robot, const NameIndex& joint_of, const JointSpec& joint) {
  if (joint.mimic_master.empty()) return;
  const std::string at = joint_at(joint);
  const auto found = joint_of.find(joint.mimic_master);
  if (found == joint_of.end()) {
    throw InputError(
        fmt::format("{}: mimics joint '{}', which does not exist; repair_joints (--repair-joints) "
                    "lets it move by itself",
                    at, joint.mimic_master));
  }
  const JointSpec& master = robot.joints[found->second];
  if (master.fixed || joint.fixed || joint_nv(joint.type) != 1 || joint_nv(master.type) != 1) {
    throw InputError(
        fmt::format("{}: mimics joint '{}'; both must be revolute or prismatic; "
                    "repair_joints (--repair-joints) lets it move by itself",
                    at, joint.mimic_master));
  }
  if (!std::isfinite(joint.mimic_multiplier) || !std::isfinite(joint.mimic_offset)) {
    throw InputError(at + ": mimic multiplier and offset must be finite");
  }
  // A closed chain of mimics would leave the joints without a master.
  const JointSpec* next = &joint;
  for (size_t n = 0; n <= robot.joints.size(); ++n) {
    if (next->mimic_master.empty()) return;
    const auto it = joint_of.find(next->mimic_master);
    if (it == joint_of.end()) return;  // the check of that joint reports it
    next = &robot.joints[it->second];
    if (next == &joint) throw InputError(at + ": mimics itself, directly or through other joints");
  }
}

RobotTree connect(const RobotSpec& robot, const NameIndex& link_of) {
  const size_t num_links = robot.links.size();
  RobotTree tree;
  tree.children.resize(num_links);
  std::vector<int> parent_joint(num_links, -1);
  for (size_t j = 0; j < robot.joints.size(); ++j) {
    const JointSpec& joint = robot.joints[j];
    const auto parent = link_of.find(joint.parent);
    const auto child = link_of.find(joint.child);
    int& above = parent_joint[child->second];
    if (above >= 0) {
      throw InputError(fmt::format(
          "{}: link '{}' already hangs on joint '{}'; a link has one parent (loops cannot be "
          "closed by a second parent)",
          joint_at(joint), joint.child, robot.joints[above].name));
    }
    above = static_cast<int>(j);
    tree.children[parent->second].push_back(static_cast<int>(j));
    tree.joint_child.push_back(child->second);
  }
  tree.root = -1;
  for (size_t i = 0; i < num_links; ++i) {
    if (parent_joint[i] >= 0) continue;
    if (tree.root >= 0) {
      throw InputError(fmt::format(
          "{}: no joint leads to it, nor to link '{}': a robot has one root. Join them by a joint, "
          "or put them into two files",
          link_at(robot.links[i]), robot.links[tree.root].name));
    }
    tree.root = static_cast<int>(i);
  }
  if (tree.root < 0) {
    throw InputError(
        fmt::format("{}: its joints form a closed loop; a tree with one root is needed",
                    link_at(robot.links[0])));
  }
  return tree;
}

/// Checks that the root reaches every link: with one root and at most one parent each, a link that
/// it does not reach is in a closed loop.
void check_reachable(const RobotSpec& robot, const RobotTree& tree) {
  std::vector<char> reached(robot.links.size(), 0);
  std::vector<int> open{tree.root};
  while (!open.empty()) {
    const int link = open.back();
    open.pop_back();
    reached[link] = 1;
    for (const int joint : tree.children[link]) open.push_back(tree.joint_child[joint]);
  }
  for (size_t i = 0; i < robot.links.size(); ++i) {
    if (reached[i]) continue;
    throw InputError(
        fmt::format("{}: its joints form a closed loop not connected to root link '{}'",
                    link_at(robot.links[i]), robot.links[tree.root].name));
  }
}

}  // namespace

void check_pose(const Pose& pose, const std::string& where) {
  if (!pose.rotation.allFinite() || !pose.translation.allFinite()) {
    throw InputError(where + ": position and orientation must be finite numbers");
  }
  if (pose.translation.cwiseAbs().maxCoeff() > limits::kMaxLength) {
    throw InputError(fmt::format("{}: it lies {:.3g} m away; at most {:g} m are taken", where,
                                 pose.translation.cwiseAbs().maxCoeff(), limits::kMaxLength));
  }
  constexpr double kOrthonormalTolerance = 1e-9;
  if (!(pose.rotation * pose.rotation.transpose()).isIdentity(kOrthonormalTolerance) ||
      pose.rotation.determinant() < 0.0) {
    throw InputError(where + ": the orientation is not a rotation");
  }
}

void check_material(const Material& material, const std::string& where) {
  check_nonnegative(material.friction, "friction", where);
  check_nonnegative(material.static_friction, "static friction", where);
  check_nonnegative(material.damping, "damping", where);
  check_nonnegative(material.dissipation, "dissipation", where);
  const Spring& area = material.per_area;
  check_nonnegative(area.damping, "damping per area", where);
  check_nonnegative(area.dissipation, "dissipation", where);
  if (!(area.stiffness > 0.0))
    throw InputError(fmt::format("{}: stiffness per area is {} N/m^3; it must be positive", where,
                                 area.stiffness));
  if (!area.is_soft() && (area.damping > 0.0 || area.dissipation > 0.0))
    throw InputError(where +
                     ": damping per area is that of a surface with a `stiffness_per_area` "
                     "[N/m^3]; give one, or leave it out");
  if (!(material.stiffness > 0.0))
    throw InputError(
        fmt::format("{}: stiffness is {} N/m; it must be positive", where, material.stiffness));
  const bool yields = material.stiffness < std::numeric_limits<double>::infinity();
  if (!yields && (material.damping > 0.0 || material.dissipation > 0.0))
    throw InputError(where +
                     ": damping and dissipation are those of a surface with a `stiffness` [N/m]; "
                     "give one, or leave them out");
  if (material.is_soft() && material.restitution > 0.0)
    throw InputError(where +
                     ": a surface with a stiffness bounces by its spring and damper; give "
                     "`damping` or `dissipation` in place of restitution");
  check_stribeck_speed(material.stribeck_speed, "m/s", where);
  if (!material.surface_velocity.allFinite())
    throw InputError(where + ": surface_velocity is not finite");
  check_nonnegative(material.friction_across, "friction across the axis", where);
  if (!material.friction_axis.allFinite())
    throw InputError(where + ": friction_axis is not finite");
  if (!material.friction_axis.isZero(0.0) && material.friction > 0.0 &&
      !(material.friction_across > 0.0))
    throw InputError(where + ": friction across the axis is 0; it must be positive, as along it");
  check_nonnegative(material.torsional_friction, "torsional (spinning) friction", where);
  check_nonnegative(material.rolling_friction, "rolling friction", where);
  check_nonnegative(material.restitution, "restitution", where);
  if (material.restitution > 1.0) {
    throw InputError(
        fmt::format("{}: restitution is {}; it must lie in 0 ... 1", where, material.restitution));
  }
}

void check_shape(const Shape& shape, const std::string& where) {
  const auto positive = [&](double value, const char* what) {
    if (!(std::isfinite(value) && value > 0.0)) {
      throw InputError(
          fmt::format("{}: {} is {}; it must be finite and positive", where, what, value));
    }
    if (value >= limits::kMinLength && value <= limits::kMaxLength) return;
    throw InputError(
        fmt::format("{}: {} is {:g} m; {:g} ... {:g} m are taken (are the units right?)", where,
                    what, value, limits::kMinLength, limits::kMaxLength));
  };
  switch (shape.type) {
    case ShapeType::kPlane:
      break;
    case ShapeType::kSphere:
      positive(shape.size[0], "the radius");
      break;
    case ShapeType::kBox:
      for (int i = 0; i < 3; ++i) positive(shape.size[i], "a side of the box");
      break;
    case ShapeType::kCapsule:
      positive(shape.size[0], "the radius");
      if (shape.size[1] != 0.0) positive(shape.size[1], "the length");  // zero length: a sphere
      break;
    case ShapeType::kCylinder:
      positive(shape.size[0], "the radius");
      positive(shape.size[1], "the length");
      break;
    case ShapeType::kConvexMesh:
      if (!shape.mesh || shape.mesh->vertices.size() < 4) {
        throw InputError(where + ": the mesh is missing or has fewer than four vertices");
      }
      break;
    case ShapeType::kTerrain:
      if (!shape.terrain) throw InputError(where + ": the terrain is missing");
      break;
  }
}

RobotTree check_robot(const RobotSpec& robot) {
  const std::string at = robot.where.empty() ? "robot '" + robot.name + "'" : robot.where;
  if (robot.links.empty()) throw InputError(at + ": there is no link; a robot needs at least one");
  NameIndex link_of;
  NameIndex joint_of;
  Faults faults;
  for (size_t i = 0; i < robot.links.size(); ++i) {
    faults.collect([&] { check_link(robot.links[i]); });
    if (!link_of.emplace(robot.links[i].name, static_cast<int>(i)).second)
      faults.add(link_at(robot.links[i]) + ": the name is given to two links; rename one");
  }
  for (size_t i = 0; i < robot.joints.size(); ++i) {
    faults.collect([&] { check_joint(robot.joints[i]); });
    if (!joint_of.emplace(robot.joints[i].name, static_cast<int>(i)).second)
      faults.add(joint_at(robot.joints[i]) + ": the name is given to two joints; rename one");
  }
  for (const JointSpec& joint : robot.joints) {
    faults.collect([&] { check_mimic(robot, joint_of, joint); });
    for (const std::string& end : {joint.parent, joint.child})
      if (link_of.count(end) == 0)
        faults.add(fmt::format("{}: link '{}' does not exist", joint_at(joint), end));
  }
  faults.throw_if_any();
  RobotTree tree = connect(robot, link_of);
  check_reachable(robot, tree);
  return tree;
}

}  // namespace counterpoint
