#include "counterpoint/model/scene/scene_sensors.h"

#include <algorithm>

#include "counterpoint/model/scene/scene_shapes.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// A device of several quantities, or under another name than theirs.
struct Device {
  const char* name;
  std::vector<SensorKind> kinds;
  bool own_axes = false;
};

const std::vector<Device>& devices() {
  using enum SensorKind;
  static const std::vector<Device> kDevices = {
      {"imu", {kSpecificForce, kAngularVelocity}, true},
      {"accelerometer", {kSpecificForce}, true},
      {"gyro", {kAngularVelocity}, true},
      {"wrench", {kForce, kTorque}},
      {"link_pose", {kPosition, kOrientation}},
      {"link_velocity", {kLinearVelocity, kAngularVelocity}},
      {"link_acceleration", {kLinearAcceleration, kAngularAcceleration}},
      {"momentum", {kLinearMomentum, kAngularMomentum}}};
  return kDevices;
}

/// Sets kinds and axes from the name of a device or of a single quantity.
void read_sensor_kind(const YamlValue& in, Sensor& sensor) {
  const std::string name = in.text();
  std::string known;
  for (const Device& device : devices()) {
    known += device.name + std::string(", ");
    if (name != device.name) continue;
    sensor.kinds = device.kinds;
    sensor.own_axes = device.own_axes;
    return;
  }
  for (int i = 0; i < kNumSensorKinds; ++i) {
    const auto kind = static_cast<SensorKind>(i);
    if (name == sensor_kind_name(kind)) sensor.kinds = {kind};
    known += (i > 0 ? ", " : "") + std::string(sensor_kind_name(kind));
  }
  if (sensor.kinds.empty()) in.fail("'" + name + "' is no kind of sensor; known: " + known);
}

void read_sensor_errors(const YamlValue& in, SensorErrors& errors) {
  if (in.has("bias")) errors.bias = in.at("bias").numbers();
  if (in.has("noise")) errors.noise = in.at("noise").numbers();
  if (in.has("quantum")) errors.quantum = in.at("quantum").numbers();
  if (in.has("rate")) errors.rate = in.at("rate").positive();
  if (in.has("delay")) errors.delay = in.at("delay").number(0.0, kInfinity);
}

/// Reads `in: world`, or `in: link` for the axes of the sensor.
void read_sensor_axes(const YamlValue& in, Sensor& sensor) {
  if (!in.is_text("world") && !in.is_text("link")) in.fail("world or link is expected");
  const bool own = in.is_text("link");
  const auto differs = [&](SensorKind kind) { return !takes_axes(kind) || senses_wrench(kind); };
  if (sensor.own_axes != own && std::any_of(sensor.kinds.begin(), sensor.kinds.end(), differs))
    in.fail("the axes of this kind are fixed; leave the key out");
  sensor.own_axes = own;
}

/// Reads [x, y] or [x, y, z].
void read_sensor_size(const YamlValue& in, Sensor& sensor) {
  if (!senses_contacts(sensor.kinds.front())) in.fail("size is for touch and pressure only");
  const std::vector<double> edges = in.numbers();
  if (edges.size() != 2 && edges.size() != 3) in.fail("two or three edges [m] are expected");
  std::copy(edges.begin(), edges.end(), sensor.size.data());
}

/// Reads the place on the link; for a range, `axis` in place of a rotation is the direction.
Pose read_sensor_pose(const YamlValue& in, const Sensor& sensor) {
  Pose pose = read_pose(in);
  if (!in.has("axis")) return pose;
  const YamlValue value = in.at("axis");
  const Vector3 axis = value.vector3();
  if (sensor.kinds.front() != SensorKind::kRange) value.fail("an axis is for a range only");
  if (in.has("rpy") || in.has("quaternion")) value.fail("give an axis or a rotation, not both");
  if (axis.norm() < 1e-9) value.fail("an axis cannot be zero");
  pose.rotation = rotation_z_to(axis.normalized());
  return pose;
}

}  // namespace

SensorSpec read_sensor(const YamlValue& in) {
  in.expect_map({"name",  "kind",       "link",  "joint",   "tendon",      "actuator", "position",
                 "rpy",   "quaternion", "axis",  "in",      "relative_to", "from",     "size",
                 "limit", "bias",       "noise", "quantum", "rate",        "delay"});
  SensorSpec spec;
  spec.where = in.where();
  spec.sensor.name = in.at("name").text();
  read_sensor_kind(in.at("kind"), spec.sensor);
  if (in.has("link")) spec.link = in.at("link").text();
  if (in.has("joint")) spec.joint = in.at("joint").text();
  if (in.has("tendon")) spec.tendon = in.at("tendon").text();
  if (in.has("actuator")) spec.actuator = in.at("actuator").text();
  if (in.has("relative_to")) spec.relative_to = in.at("relative_to").text();
  if (in.has("from")) spec.from = in.at("from").text();
  spec.sensor.X_FS = read_sensor_pose(in, spec.sensor);
  if (in.has("in")) read_sensor_axes(in.at("in"), spec.sensor);
  if (in.has("size")) read_sensor_size(in.at("size"), spec.sensor);
  if (in.has("limit")) {
    if (spec.sensor.kinds.front() != SensorKind::kRange)
      in.at("limit").fail("a limit is for a range only");
    spec.sensor.limit = in.at("limit").positive();
  }
  read_sensor_errors(in, spec.sensor.errors);
  return spec;
}

}  // namespace counterpoint
