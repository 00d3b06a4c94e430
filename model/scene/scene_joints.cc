#include "counterpoint/model/scene/scene_joints.h"

#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

constexpr const char* kAll = "all";

/// Returns the part with the given name; an error, located at `value`, lists the known names.
template <typename Part>
Part& named(const std::string& name, const YamlValue& value, std::vector<Part>& parts,
            const char* kind) {
  const auto it =
      std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == name; });
  if (it != parts.end()) return *it;
  std::string known;
  for (const Part& p : parts) known += (known.empty() ? "" : ", ") + p.name;
  value.fail(
      fmt::format("there is no {0} '{1}'; {0}s: {2}", kind, name, known.empty() ? "none" : known));
}

bool moves(const JointSpec& joint) { return !joint.fixed; }
bool has_one_coordinate(const JointSpec& joint) {
  return moves(joint) && joint_nv(joint.type) == 1;
}
bool takes_servo(const JointSpec& joint) {
  return has_one_coordinate(joint) && joint.mimic_master.empty();
}

double not_negative(const YamlValue& value) { return value.number(0.0, kInfinity); }

/// Reads a number, or `none` to remove a limit that the robot's file gives.
double limit(const YamlValue& value, bool zero_allowed) {
  if (value.is_text("none")) return kInfinity;
  return zero_allowed ? not_negative(value) : value.positive();
}

void read_servo(const YamlValue& in, JointSpec& joint) {
  in.expect_map({"stiffness", "damping", "position", "velocity"});
  ServoSpec& servo = joint.servo;
  if (in.has("stiffness")) servo.stiffness = not_negative(in.at("stiffness"));
  if (in.has("damping")) servo.damping = not_negative(in.at("damping"));
  if (in.has("position")) servo.position = in.at("position").number();
  if (in.has("velocity")) servo.velocity = in.at("velocity").number();
}

/// A key of `dynamics`: the joints it applies to, a description of these for messages, and its
/// reader.
struct Key {
  const char* name;
  bool (*applies)(const JointSpec&);
  const char* needs;
  void (*read)(const YamlValue&, JointSpec&);
};
constexpr const char* kMoving = "a joint that is not fixed";
constexpr const char* kOne = "a revolute or prismatic joint";
const Key kKeys[] = {
    {"damping", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.damping = not_negative(v); }},
    {"dry_friction", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.dry_friction = not_negative(v); }},
    {"breakaway_friction", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.breakaway_friction = not_negative(v); }},
    {"stribeck_speed", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.stribeck_speed = v.positive(); }},
    {"armature", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.armature = not_negative(v); }},
    {"stiffness", has_one_coordinate, kOne,
     [](const YamlValue& v, JointSpec& j) { j.stiffness = not_negative(v); }},
    {"reference", has_one_coordinate, kOne,
     [](const YamlValue& v, JointSpec& j) { j.reference = v.number(); }},
    {"effort_limit", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.effort_limit = limit(v, true); }},
    {"velocity_limit", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.velocity_limit = limit(v, false); }},
    {"rotation_limit", [](const JointSpec& j) { return j.type == JointType::kSpherical; },
     "a spherical joint", [](const YamlValue& v, JointSpec& j) { j.upper = v.positive(); }},
    {"prescribed", moves, kMoving,
     [](const YamlValue& v, JointSpec& j) { j.prescribed = v.boolean(); }},
    {"servo", takes_servo, "a revolute or prismatic joint that mimics none", read_servo},
};

void expect_keys(const YamlValue& in) {
  in.expect_map({"damping", "dry_friction", "breakaway_friction", "stribeck_speed", "armature",
                 "stiffness", "reference", "effort_limit", "velocity_limit", "rotation_limit",
                 "servo", "prescribed"});
}

void read_all(const YamlValue& in, RobotSpec& robot) {
  expect_keys(in);
  for (const Key& key : kKeys) {
    if (!in.has(key.name)) continue;
    bool used = false;
    for (JointSpec& joint : robot.joints) {
      // A floating joint has no bearing, so `all` does not include it; it may be named explicitly.
      if (!key.applies(joint) || joint.type == JointType::kFloating) continue;
      key.read(in.at(key.name), joint);
      used = true;
    }
    if (!used) {
      in.at(key.name).fail(fmt::format("no joint takes it: it needs {}; remove it", key.needs));
    }
  }
}

void read_joint(const YamlValue& in, JointSpec& joint) {
  expect_keys(in);
  for (const Key& key : kKeys) {
    if (!in.has(key.name)) continue;
    if (!key.applies(joint)) {
      std::string is = fmt::format("mimics joint '{}'", joint.mimic_master);
      if (joint.mimic_master.empty()) is = fmt::format("is {}", joint_type_name(joint.type));
      if (joint.fixed) is = "is fixed";
      in.at(key.name).fail(fmt::format("joint '{}' {}; {} is expected", joint.name, is, key.needs));
    }
    key.read(in.at(key.name), joint);
  }
}

/// Refuses a `breakaway_friction` below the `dry_friction` of a joint.
void expect_breakaway(const YamlValue& in, const JointSpec& joint) {
  constexpr const char* kKey = "breakaway_friction";
  if (joint.fixed || joint.breakaway_friction == 0.0) return;
  if (joint.breakaway_friction >= joint.dry_friction) return;
  const char* name = joint.name.c_str();
  const bool named = in.has(name) && in.at(name).has(kKey);
  in.at(named ? name : kAll)
      .at(kKey)
      .fail(fmt::format("is {:g}, below the dry_friction {:g} of joint '{}'",
                        joint.breakaway_friction, joint.dry_friction, joint.name));
}

}  // namespace

void read_joint_types(const YamlValue& in, RobotSpec& robot) {
  for (const auto& [name, value] : in.entries()) {
    JointSpec& joint = named(name, value, robot.joints, "joint");
    if (value.text() != "spherical") {
      value.fail(fmt::format("'{}' is not known here; spherical is expected", value.text()));
    }
    JointSpec ball;
    ball.name = joint.name;
    ball.type = JointType::kSpherical;
    ball.parent = joint.parent;
    ball.child = joint.child;
    ball.X_PJ = joint.X_PJ;
    ball.where = joint.where;
    robot.notes.push_back(
        {value.where(),
         fmt::format("joint '{}', {} in its file, is a ball joint; limits, mimic, damping, "
                     "friction and armature that its file gives are not used",
                     name, joint.fixed ? "fixed" : joint_type_name(joint.type))});
    joint = ball;
  }
}

void read_dynamics(const YamlValue& in, RobotSpec& robot) {
  for (const JointSpec& joint : robot.joints) {
    if (joint.name == kAll && in.has(kAll))
      in.at(kAll).fail("means every joint, but the model has a joint of that name; rename it");
  }
  if (in.has(kAll)) read_all(in.at(kAll), robot);
  for (const auto& [name, value] : in.entries()) {
    if (name != kAll) read_joint(value, named(name, value, robot.joints, "joint"));
  }
  for (const JointSpec& joint : robot.joints) expect_breakaway(in, joint);
}

Drag read_drag(const YamlValue& in) {
  in.expect_map({"linear", "quadratic", "angular", "angular_quadratic"});
  Drag drag;
  if (in.has("linear")) drag.linear = not_negative(in.at("linear"));
  if (in.has("quadratic")) drag.quadratic = not_negative(in.at("quadratic"));
  if (in.has("angular")) drag.angular = not_negative(in.at("angular"));
  if (in.has("angular_quadratic"))
    drag.angular_quadratic = not_negative(in.at("angular_quadratic"));
  return drag;
}

void read_link_compensations(const YamlValue& in, RobotSpec& robot) {
  for (const auto& [name, value] : in.entries())
    named(name, value, robot.links, "link").gravity_compensation = value.number();
}

void read_link_drags(const YamlValue& in, RobotSpec& robot) {
  for (const auto& [name, value] : in.entries()) {
    named(name, value, robot.links, "link").drag = read_drag(value);
  }
}

}  // namespace counterpoint
