#include "counterpoint/model/scene/scene_closures.h"

#include "counterpoint/model/scene/scene_shapes.h"

namespace counterpoint {
namespace {

ClosureType read_type(const YamlValue& in) {
  std::string names;
  for (int i = 0; i < kNumClosureTypes; ++i) {
    const auto type = static_cast<ClosureType>(i);
    names += std::string(i > 0 ? ", " : "") + closure_type_name(type);
    if (in.text() == closure_type_name(type)) return type;
  }
  in.fail("'" + in.text() + "' is not one of " + names);
}

/// Reads one number for all three axes, or three.
void read_axes(const YamlValue& in, const char* key, std::optional<Vector3>& out) {
  if (!in.has(key)) return;
  const YamlValue value = in.at(key);
  out = value.is_list() ? value.vector3() : Vector3(Vector3::Constant(value.number()));
}

void read_switch(const YamlValue& in, ClosureSpec& closure) {
  const auto read = [&](const char* key, bool& out) {
    if (in.has(key)) out = in.at(key).boolean();
  };
  read("switched", closure.switched);
  read("attached", closure.attached);
  read("in_place", closure.in_place);
  if (in.has("breaking_force")) closure.breaking_force = in.at("breaking_force").positive();
  if (in.has("breaking_torque")) closure.breaking_torque = in.at("breaking_torque").positive();
}

}  // namespace

ClosureSpec read_closure(const YamlValue& in) {
  in.expect_map({"type",
                 "between",
                 "name",
                 "anchor_a",
                 "anchor_b",
                 "rpy",
                 "quaternion",
                 "length",
                 "collide",
                 "axis",
                 "pitch",
                 "rope",
                 "stiffness",
                 "damping",
                 "rotational_stiffness",
                 "rotational_damping",
                 "switched",
                 "attached",
                 "breaking_force",
                 "breaking_torque",
                 "in_place"});
  ClosureSpec closure;
  closure.type = read_type(in.at("type"));
  const std::vector<YamlValue> between = in.at("between").list();
  if (between.size() != 2) in.at("between").fail("two links [a, b] are expected");
  closure.link_a = between[0].text();
  closure.link_b = between[1].text();
  if (in.has("name")) closure.name = in.at("name").text();
  if (in.has("anchor_a")) closure.anchor_a = in.at("anchor_a").vector3();
  if (in.has("anchor_b")) closure.anchor_b = in.at("anchor_b").vector3();
  if (in.has("rpy") || in.has("quaternion")) closure.orientation = read_pose(in).rotation;
  if (in.has("length")) closure.length = in.at("length").positive();
  if (in.has("collide")) closure.collide = in.at("collide").boolean();
  if (in.has("axis")) closure.axis = in.at("axis").vector3();
  if (in.has("pitch")) closure.pitch = in.at("pitch").number();
  if (in.has("rope")) closure.rope = in.at("rope").boolean();
  read_axes(in, "stiffness", closure.stiffness);
  read_axes(in, "damping", closure.damping);
  read_axes(in, "rotational_stiffness", closure.rotational_stiffness);
  read_axes(in, "rotational_damping", closure.rotational_damping);
  read_switch(in, closure);
  closure.where = in.where();
  return closure;
}

}  // namespace counterpoint
