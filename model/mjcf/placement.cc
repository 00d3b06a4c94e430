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

/// Sets the servo targets from the controls at the start. Actuator forces without a servo are
/// inputs: they are noted, not applied.
void set_controls(const MjcfModel& model, const MjcfModel::Keyframe* key, RobotSpec& robot) {
  std::map<std::string, double> pull;  // sum of gain u + bias; key: joint
  for (std::size_t i = 0; i < model.actuators.size(); ++i) {
    const MjcfModel::Actuator& a = model.actuators[i];
    const double u = control_of(model, key, i);
    if (a.joint.empty() ? u == 0.0
                        : a.stiffness == 0.0 && a.damping == 0.0 && a.gain * u + a.bias == 0.0)
      continue;
    if (!a.joint.empty()) {
      pull[a.joint] += a.gain * u + a.bias;
      continue;
    }
    robot.notes.push_back(
        {a.where, fmt::format("its control of {} at the start is not applied", u)});
  }
  for (JointSpec& joint : robot.joints) {
    const auto found = pull.find(joint.name);
    if (found == pull.end()) continue;
    if (joint.servo.stiffness > 0.0)
      joint.servo.position = found->second / joint.servo.stiffness;
    else if (joint.servo.damping > 0.0)
      joint.servo.velocity = found->second / joint.servo.damping;
    else
      robot.notes.push_back(
          {joint.where, fmt::format("its motor's force of {} at the start is not applied: "
                                    "it is an input",
                                    found->second)});
  }
}

}  // namespace

std::vector<StartVelocity> add_mjcf(const MjcfModel& model, const std::string& keyframe,
                                    const Pose& X_WL, const std::string& prefix,
                                    ModelBuilder& builder) {
  const MjcfModel::Keyframe* key = find_keyframe(model, keyframe);
  RobotSpec robot = model.robot;
  if (key && model.keyframes.size() > 1)
    robot.notes.push_back(
        {key->where, fmt::format("starts at keyframe '{}', one of {}; a scene may name "
                                 "another",
                                 key->name, model.keyframes.size())});
  set_controls(model, key, robot);
  builder.add_robot(robot, Base::kFixed, X_WL, prefix);
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
