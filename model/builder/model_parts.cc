#include <fmt/format.h>

#include "counterpoint/model/robot_files.h"

namespace counterpoint {
namespace {

constexpr std::pair<LeaveOut, const char*> kLeaveOut[] = {
    {LeaveOut::kFluid, "fluid"},           {LeaveOut::kTendons, "tendons"},
    {LeaveOut::kActuators, "actuators"},   {LeaveOut::kJointForces, "joint_forces"},
    {LeaveOut::kEqualities, "equalities"}, {LeaveOut::kFrictionDirections, "friction_directions"},
    {LeaveOut::kMocap, "mocap"},           {LeaveOut::kSlip, "slip"}};

}  // namespace

const char* leave_out_name(LeaveOut what) {
  for (const auto& [one, name] : kLeaveOut)
    if (one == what) return name;
  return "?";
}

std::optional<LeaveOut> leave_out_from_name(const std::string& name) {
  for (const auto& [one, known] : kLeaveOut)
    if (name == known) return one;
  return std::nullopt;
}

std::string leave_out_names() {
  std::string list;
  for (const auto& [one, name] : kLeaveOut)
    list += (list.empty() ? "" : one == LeaveOut::kSlip ? " or " : ", ") + std::string(name);
  return list;
}

std::string how_to_leave_out(const char* format, const std::filesystem::path& file, LeaveOut word) {
  return fmt::format(
      ". To go on without it name the file in a scene: models: [{{{}: {}, leave_out: [{}]}}]",
      format, file.filename().string(), leave_out_name(word));
}

void add_parts(const ModelParts& parts, const Pose& X_WL, const std::string& prefix,
               ModelBuilder& builder) {
  for (const ModelParts::Environment& e : parts.environment)
    builder.add_environment(prefix + e.name, e.shape, X_WL * e.X_WG, e.material);
  for (const ModelParts::Exclusion& e : parts.exclusions)
    builder.exclude_pair(prefix + e.a, prefix + e.b, e.reason);
  for (const auto& [a, b] : parts.inclusions) builder.include_pair(prefix + a, prefix + b);
  for (const ModelParts::Surface& s : parts.surfaces)
    builder.set_pair_surface(prefix + s.a, prefix + s.b, s.surface);
  for (ClosureSpec closure : parts.closures) {
    closure.name = prefix + closure.name;
    closure.link_a = prefix + closure.link_a;
    closure.link_b = prefix + closure.link_b;
    builder.add_closure(closure);
  }
  for (TendonSpec tendon : parts.tendons) {
    tendon.name = prefix + tendon.name;
    for (auto& [joint, coefficient] : tendon.joints) joint = prefix + joint;
    for (TendonSpec::Place& place : tendon.path) place.link = prefix + place.link;
    builder.add_tendon(tendon);
  }
  for (ActuatorSpec actuator : parts.commanded) {
    actuator.actuator.name = prefix + actuator.actuator.name;
    for (std::string* name : {&actuator.joint, &actuator.tendon, &actuator.link})
      if (!name->empty()) *name = prefix + *name;
    builder.add_actuator(actuator);
  }
  for (SensorSpec sensor : parts.sensors) {
    sensor.sensor.name = prefix + sensor.sensor.name;
    for (std::string* name : {&sensor.link, &sensor.joint, &sensor.tendon, &sensor.actuator,
                              &sensor.relative_to, &sensor.from})
      if (!name->empty()) *name = prefix + *name;
    // A sensor changes no motion: one that cannot be computed is noted, and the rest is read.
    try {
      builder.add_sensor(sensor);
    } catch (const InputError& error) {
      builder.add_note({prefix + "sensors", error.what() + std::string(": left out")});
    }
  }
}

}  // namespace counterpoint
