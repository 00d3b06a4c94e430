#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/model/robot_files.h"

namespace counterpoint {
namespace {

const MjcfModel::Keyframe* find_keyframe(const MjcfModel& model, const std::string& name) {
  if (name == "none") return nullptr;
  if (name.empty()) return model.keyframes.empty() ? nullptr : &model.keyframes.front();
  std::string list;
  for (const MjcfModel::Keyframe& key : model.keyframes) {
    if (key.name == name) return &key;
    list += (list.empty() ? "" : ", ") + key.name;
  }
  throw InputError(fmt::format("{}: there is no keyframe '{}'; keyframes: {}", model.robot.where,
                               name, list.empty() ? "none" : list));
}

double control_of(const MjcfModel& model, const MjcfModel::Keyframe* key, std::size_t i) {
  const MjcfModel::Actuator& actuator = model.actuators[i];
  double u = key && !key->control.empty() ? key->control[i] : 0.0;
  if (actuator.least) u = std::clamp(u, *actuator.least, *actuator.most);
  return u;
}

/// Sum of gain u + bias of the actuators of each joint or tendon, by name.
using Pulls = std::map<std::string, double>;

/// Notes a motor's force, which is an input and not applied.
void note_input(const std::string& where, double force, std::vector<Note>& notes) {
  if (force != 0.0)
    notes.push_back({where, fmt::format("its motor's force of {} at the start is not applied: "
                                        "it is an input",
                                        force)});
}

void set_joint_targets(const Pulls& pull, RobotSpec& robot) {
  for (JointSpec& joint : robot.joints) {
    const auto found = pull.find(joint.name);
    if (found == pull.end()) continue;
    if (joint.servo.stiffness > 0.0)
      joint.servo.position = found->second / joint.servo.stiffness;
    else if (joint.servo.damping > 0.0)
      joint.servo.velocity = found->second / joint.servo.damping;
    else
      note_input(joint.where, found->second, robot.notes);
  }
}

void set_tendon_targets(const Pulls& pull, std::vector<TendonSpec>& tendons,
                        std::vector<Note>& notes) {
  for (TendonSpec& tendon : tendons) {
    const auto found = pull.find(tendon.name);
    if (found == pull.end()) continue;
    if (tendon.servo.stiffness > 0.0)
      tendon.servo_target = found->second / tendon.servo.stiffness;
    else if (tendon.servo.damping > 0.0)
      tendon.servo.speed = found->second / tendon.servo.damping;
    else
      note_input(tendon.where, found->second, notes);
  }
}

/// Sets the servo targets from the controls at the start. Actuator forces without a servo are
/// inputs: they are noted, not applied.
void set_controls(const MjcfModel::Keyframe* key, MjcfModel& model) {
  Pulls of_joints, of_tendons;
  for (std::size_t i = 0; i < model.actuators.size(); ++i) {
    const MjcfModel::Actuator& a = model.actuators[i];
    const double u = control_of(model, key, i), pull = a.gain * u + a.bias;
    const bool servo = a.stiffness > 0.0 || a.damping > 0.0;
    if (!a.joint.empty() && (servo || pull != 0.0)) of_joints[a.joint] += pull;
    if (!a.tendon.empty() && (servo || pull != 0.0)) of_tendons[a.tendon] += pull;
    if (a.joint.empty() && a.tendon.empty() && u != 0.0)
      model.robot.notes.push_back(
          {a.where, fmt::format("its control of {} at the start is not applied", u)});
  }
  set_joint_targets(of_joints, model.robot);
  set_tendon_targets(of_tendons, model.tendons, model.robot.notes);
}

}  // namespace

std::vector<StartVelocity> add_mjcf(const MjcfModel& given, const std::string& keyframe,
                                    const Pose& X_WL, const std::string& prefix,
                                    ModelBuilder& builder) {
  MjcfModel model = given;
  const MjcfModel::Keyframe* key = find_keyframe(model, keyframe);
  if (key && model.keyframes.size() > 1)
    model.robot.notes.push_back(
        {key->where, fmt::format("starts at keyframe '{}', one of {}; a scene may name "
                                 "another",
                                 key->name, model.keyframes.size())});
  set_controls(key, model);
  builder.add_robot(model.robot, Base::kFixed, X_WL, prefix);
  add_parts(model, X_WL, prefix, builder);
  std::vector<StartVelocity> velocities;
  std::size_t q = 0, v = 0;
  for (const MjcfModel::Coordinate& c : model.coordinates) {
    const std::size_t nq = joint_nq(c.type), nv = joint_nv(c.type);
    const double* at = key && !key->q.empty() ? key->q.data() + q : c.reference.data();
    builder.set_default_position(prefix + c.joint,
                                 Eigen::Map<const VectorX>(at, static_cast<Eigen::Index>(nq)));
    if (key && !key->v.empty())
      velocities.push_back(
          {prefix + c.joint,
           {key->v.begin() + static_cast<long>(v), key->v.begin() + static_cast<long>(v + nv)}});
    q += nq;
    v += nv;
  }
  return velocities;
}

}  // namespace counterpoint
