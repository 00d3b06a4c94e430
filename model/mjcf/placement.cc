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

/// Sets the target of a servo of these gains that pulls with `pull` at the origin; notes the force
/// of a motor without gains, which is an input and not applied.
void set_target(double pull, double stiffness, double damping, const std::string& where,
                std::optional<double>& position, double& velocity, std::vector<Note>& notes) {
  if (stiffness > 0.0)
    position = pull / stiffness;
  else if (damping > 0.0)
    velocity = pull / damping;
  else if (pull != 0.0)
    notes.push_back({where, fmt::format("its motor's force of {} at the start is not applied: "
                                        "it is an input",
                                        pull)});
}

/// Sets the servo targets from the controls at the start. Actuator forces without a servo are
/// inputs: they are noted, not applied.
void set_controls(const MjcfModel::Keyframe* key, MjcfModel& model) {
  std::map<std::string, double> of_joints, of_tendons;  // sums of gain u + bias, by name
  for (std::size_t i = 0; i < model.actuators.size(); ++i) {
    const MjcfModel::Actuator& a = model.actuators[i];
    const double u = control_of(model, key, i), pull = a.gain * u + a.bias;
    const bool servo = a.stiffness > 0.0 || a.damping > 0.0;
    if (!a.joint.empty() && (servo || pull != 0.0)) of_joints[a.joint] += pull;
    if (!a.tendon.empty() && (servo || pull != 0.0)) of_tendons[a.tendon] += pull;
    if (a.commanded >= 0) {
      model.commanded[static_cast<std::size_t>(a.commanded)].actuator.command = u;
      continue;
    }
    if (a.joint.empty() && a.tendon.empty() && u != 0.0)
      model.robot.notes.push_back(
          {a.where, fmt::format("its control of {} at the start is not applied", u)});
  }
  std::vector<Note>& notes = model.robot.notes;
  for (JointSpec& joint : model.robot.joints)
    if (const auto found = of_joints.find(joint.name); found != of_joints.end())
      set_target(found->second, joint.servo.stiffness, joint.servo.damping, joint.where,
                 joint.servo.position, joint.servo.velocity, notes);
  for (TendonSpec& tendon : model.tendons)
    if (const auto found = of_tendons.find(tendon.name); found != of_tendons.end())
      set_target(found->second, tendon.servo.stiffness, tendon.servo.damping, tendon.where,
                 tendon.servo_target, tendon.servo.speed, notes);
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
  for (std::size_t i = 0; i < model.mocaps.size(); ++i) {
    VectorX pose = Eigen::Map<const VectorX>(model.mocaps[i].reference.data(), 7);
    const auto first = static_cast<Eigen::Index>(i);
    if (key && !key->mocap_position.empty())
      pose.head<3>() = Eigen::Map<const Vector3>(key->mocap_position.data() + 3 * first);
    if (key && !key->mocap_rotation.empty())
      pose.tail<4>() = Eigen::Map<const Eigen::Vector4d>(key->mocap_rotation.data() + 4 * first);
    builder.set_default_position(prefix + model.mocaps[i].joint, pose);
  }
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
