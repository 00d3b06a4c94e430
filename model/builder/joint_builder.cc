// Joints: the part of ModelBuilder that adds their bodies, forces and initial positions.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/limits.h"

namespace counterpoint {
namespace {

/// Largest limit of a ball joint [rad]: beyond half a turn its axis would change sides.
constexpr double kMaxBallLimit = 3.1;

/// Returns the default coordinates of a joint: zero, or the limit nearest to it; identity for
/// quaternions.
std::vector<double> default_coordinates(const JointInfo& joint, JointType type) {
  std::vector<double> q(joint_nq(type), 0.0);
  if (type == JointType::kSpherical) q[0] = 1.0;
  if (type == JointType::kFloating) q[3] = 1.0;
  if (q.size() == 1) q[0] = std::clamp(0.0, joint.lower, joint.upper);
  return q;
}

void check_ball_limit(const JointSpec& joint, const std::string& name) {
  if (joint.type != JointType::kSpherical || !std::isfinite(joint.upper)) return;
  if (joint.upper > 0.0 && joint.upper <= kMaxBallLimit) return;
  throw InputError(located_at(
      joint.where, fmt::format("joint '{}': the limit of a ball joint must be positive and at most "
                               "{} rad, it is {}",
                               name, kMaxBallLimit, joint.upper)));
}

}  // namespace

/// Adds the joint that connects a base to the world; X_WL is its initial pose.
int ModelBuilder::add_base(const RobotSpec& robot, const LinkSpec& root, Base base,
                           const Placement& placement, const Pose& X_WL) {
  JointSpec joint;
  joint.type = base == Base::kSpherical ? JointType::kSpherical : JointType::kFloating;
  joint.name = root.name;
  joint.child = root.name;
  joint.where = root.where;
  joint.prescribed = robot.prescribed_base;
  for (const JointSpec& other : robot.joints) {
    // A file may give a fixed joint the name of its root link; names of moving joints must differ.
    if (other.name == joint.name) joint.name = root.name + "_base";
  }
  const bool floating = base == Base::kFloating;
  const Pose pivot{Matrix3::Identity(), X_WL.translation};
  const int body = add_body(joint, placement, 0, floating ? Pose() : pivot);
  model_.joints_[body - 1].actuated = robot.prescribed_base;
  double* q = default_q_.data() + model_.bodies_[body].q_index;
  if (floating) q = std::copy_n(X_WL.translation.data(), 3, q);
  const Quaternion orientation(X_WL.rotation);
  q[0] = orientation.w();
  std::copy_n(orientation.vec().data(), 3, q + 1);
  return body;
}

int ModelBuilder::add_body(const JointSpec& joint, const Placement& placement, int parent,
                           const Pose& X_PJ) {
  const int index = model_.num_bodies();
  if (index > limits::kMaxBodies) {
    throw InputError(
        located_at(joint.where, fmt::format("more than {} moving bodies; make the scene "
                                            "smaller (count, models)",
                                            limits::kMaxBodies)));
  }
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
  if (nv == 1) info.lower = joint.lower;
  if (nv == 1 || joint.type == JointType::kSpherical) info.upper = joint.upper;
  check_ball_limit(joint, info.name);
  info.effort_limit = joint.effort_limit;
  info.velocity_limit = joint.velocity_limit;
  info.actuated = joint.type != JointType::kFloating;
  info.prescribed = joint.prescribed;
  if (joint.prescribed && (joint.servo.stiffness > 0.0 || joint.servo.damping > 0.0))
    throw InputError(located_at(joint.where, "joint '" + info.name +
                                                 "': its motion is prescribed; leave out its "
                                                 "servo, which could not move it"));
  if (joint.prescribed && !joint.mimic_master.empty())
    throw InputError(located_at(joint.where, "joint '" + info.name +
                                                 "': its motion is prescribed, so it cannot "
                                                 "follow joint '" +
                                                 joint.mimic_master + "'"));
  take_name(joint_names_, info.name, index - 1, joint.where, "joint");

  const std::vector<double> q = default_coordinates(info, joint.type);
  default_q_.insert(default_q_.end(), q.begin(), q.end());
  damping_.insert(damping_.end(), nv, joint.damping);
  armature_.insert(armature_.end(), nv, joint.armature);
  dry_friction_.insert(dry_friction_.end(), nv, joint.dry_friction);
  breakaway_friction_.insert(breakaway_friction_.end(), nv, joint.breakaway_friction);
  stribeck_speed_.insert(stribeck_speed_.end(), nv, joint.stribeck_speed);
  position_given_.push_back(0);
  joint_where_.push_back(joint.where);
  defective_link_.emplace_back();
  Tree& tree = model_.trees_.back();
  tree.body_end = index + 1;
  tree.v_end = body.v_index + nv;
  model_.bodies_.push_back(body);
  model_.joints_.push_back(info);
  add_joint_forces(joint, index - 1);
  return index;
}

/// Adds spring and servo; damping and dry friction are stored as vectors over all coordinates.
void ModelBuilder::add_joint_forces(const JointSpec& joint, int index) {
  if (joint.stiffness > 0.0) model_.springs_.push_back({index, joint.stiffness, joint.reference});
  const ServoSpec& servo = joint.servo;
  if (servo.stiffness <= 0.0 && servo.damping <= 0.0) return;
  model_.servos_.push_back({index, servo.stiffness, servo.damping, 0.0, servo.velocity});
  servo_target_.push_back(servo.position);
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
  if (!(q.array().abs() <= limits::kMaxLength).all()) {  // rejects NaN too
    throw InputError(fmt::format("joint '{}': its position must be finite numbers of at most {:g}",
                                 joint, limits::kMaxLength));
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

void ModelBuilder::apply_mimics() {
  for (int i = 0; i < model_.num_joints(); ++i) {
    const JointInfo& joint = model_.joints_[i];
    if (position_given_[i] || (joint.lower <= 0.0 && joint.upper >= 0.0)) continue;
    model_.notes_.push_back(
        {located_at(joint_where_[i], "joint '" + joint.name + "'"),
         fmt::format("zero lies outside its limits [{}, {}]; it starts at {}", joint.lower,
                     joint.upper, default_q_[model_.bodies_[i + 1].q_index])});
  }
  // At most as many passes as the longest chain of mimics has joints; check_robot excluded loops.
  bool changed = true;
  for (size_t pass = 0; changed && pass < model_.mimics_.size(); ++pass) {
    changed = false;
    for (const Mimic& mimic : model_.mimics_) {
      const double master = default_q_[model_.bodies_[mimic.master + 1].q_index];
      double& q = default_q_[model_.bodies_[mimic.joint + 1].q_index];
      const double follows = mimic.multiplier * master + mimic.offset;
      changed = changed || q != follows;
      q = follows;
    }
  }
  for (const Mimic& mimic : model_.mimics_) {
    const double q = default_q_[model_.bodies_[mimic.joint + 1].q_index];
    if (!(std::abs(q) <= limits::kMaxLength)) {
      throw InputError(located_at(
          joint_where_[mimic.joint],
          fmt::format(
              "joint '{}': following joint '{}' it would start at {}; at most {:g} is taken",
              model_.joints_[mimic.joint].name, model_.joints_[mimic.master].name, q,
              limits::kMaxLength)));
    }
    if (!position_given_[mimic.joint]) continue;
    model_.notes_.push_back(
        {located_at(joint_where_[mimic.joint], "joint '" + model_.joints_[mimic.joint].name + "'"),
         "mimics joint '" + model_.joints_[mimic.master].name +
             "'; the position given for it is replaced by the master's"});
  }
}

/// Sets the targets; a servo without a target holds the initial position of its joint.
void ModelBuilder::set_servo_targets() {
  for (size_t i = 0; i < model_.servos_.size(); ++i) {
    JointServo& servo = model_.servos_[i];
    servo.position = servo_target_[i].value_or(default_q_[model_.bodies_[servo.joint + 1].q_index]);
  }
}

}  // namespace counterpoint
