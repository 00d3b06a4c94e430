#include "counterpoint/engine/estimate/sensors/sensor.h"

#include <algorithm>

namespace counterpoint::estimation {
namespace {

using SceneSensor = counterpoint::Sensor;
using SceneKind = counterpoint::SensorKind;

void place(const Model& model, const SceneSensor& from, Sensor& to) {
  to.point = from.X_FS.translation;
  to.axes = from.X_FS.rotation;
  if (from.frame < 0) return;
  const Frame& link = model.frames()[static_cast<std::size_t>(from.frame)];
  to.body = link.body;
  to.point = link.X_BF * to.point;
  to.axes = link.X_BF.rotation * to.axes;
}

/// Whether a contact force is that on a whole body, from all others, along the axes of the world.
bool is_force_on_body(const Model& model, const SceneSensor& from, int body) {
  const auto& all = model.geometries();
  const auto count =
      std::count_if(all.begin(), all.end(), [&](const Geometry& g) { return g.body == body; });
  return body > 0 && !from.own_axes && from.others.empty() &&
         from.geometries.size() == static_cast<std::size_t>(count);
}

SensorKind translated(const Model& model, const SceneSensor& from, SceneKind kind, Sensor& to) {
  const bool in_world = from.reference < 0;
  switch (kind) {
    case SceneKind::kPosition:
      return in_world ? SensorKind::kPoint : SensorKind::kOther;
    case SceneKind::kOrientation:
      return in_world ? SensorKind::kOrientation : SensorKind::kOther;
    case SceneKind::kAngularVelocity:
      return in_world && from.own_axes ? SensorKind::kAngularVelocity : SensorKind::kOther;
    case SceneKind::kSpecificForce:
      return from.own_axes ? SensorKind::kSpecificForce : SensorKind::kOther;
    case SceneKind::kForce:
    case SceneKind::kTorque:
      if (is_welded(model, from.frame)) return SensorKind::kOther;
      return kind == SceneKind::kForce ? SensorKind::kLinkForce : SensorKind::kLinkTorque;
    case SceneKind::kContactForce:
      if (!is_force_on_body(model, from, to.body)) return SensorKind::kOther;
      to.bodies = {to.body};
      return SensorKind::kContactForce;
    case SceneKind::kJointPosition:
    case SceneKind::kJointEffort: {
      const Body& body = model.body(from.joint + 1);
      if (joint_nq(body.joint_type) != 1) return SensorKind::kOther;
      to.coordinate = body.v_index;
      to.position = body.q_index;
      if (kind == SceneKind::kJointPosition) return SensorKind::kCoordinate;
      // With a servo the effort is its force and the applied force together.
      return model.find_servo(from.joint) < 0 ? SensorKind::kJointForce : SensorKind::kOther;
    }
    default:
      return SensorKind::kOther;
  }
}

}  // namespace

int reading_size(SensorKind kind) {
  return kind == SensorKind::kOrientation ? 4 : error_size(kind);
}
int error_size(SensorKind kind) {
  return kind == SensorKind::kCoordinate || kind == SensorKind::kJointForce ? 1 : 3;
}

const char* sensor_kind_name(SensorKind kind) {
  switch (kind) {
    case SensorKind::kPoint:
      return "point";
    case SensorKind::kOrientation:
      return "orientation";
    case SensorKind::kAngularVelocity:
      return "angular_velocity";
    case SensorKind::kSpecificForce:
      return "specific_force";
    case SensorKind::kContactForce:
      return "contact_force";
    case SensorKind::kJointForce:
      return "joint_force";
    case SensorKind::kLinkForce:
      return "link_force";
    case SensorKind::kLinkTorque:
      return "link_torque";
    default:
      return "coordinate";
  }
}

const char* sensor_unit(SensorKind kind) {
  switch (kind) {
    case SensorKind::kPoint:
      return "m";
    case SensorKind::kOrientation:
      return "rad";
    case SensorKind::kAngularVelocity:
      return "rad/s";
    case SensorKind::kSpecificForce:
      return "m/s^2";
    case SensorKind::kContactForce:
      return "N";
    case SensorKind::kJointForce:
      return "N|N m";
    case SensorKind::kLinkForce:
      return "N";
    case SensorKind::kLinkTorque:
      return "N m";
    default:
      return "m|rad";
  }
}

std::vector<Sensor> scene_measurements(const Model& model, int index) {
  const SceneSensor& from = model.sensors()[static_cast<std::size_t>(index)];
  std::vector<Sensor> out;
  int row = 0;
  for (const SceneKind kind : from.kinds) {
    Sensor& to = out.emplace_back();
    to.name = from.name;
    to.scene_sensor = index;
    to.scene_row = row;
    place(model, from, to);
    to.kind = translated(model, from, kind, to);
    for (const SensorRow& one : sensor_rows(model, from, kind))
      to.columns.push_back({from.name + "." + one.suffix});
    const auto noise = static_cast<std::size_t>(row);
    if (!from.errors.noise.empty() && from.errors.noise[noise] > 0.0)
      to.deviation = from.errors.noise[noise];
    row += static_cast<int>(to.columns.size());
  }
  return out;
}

}  // namespace counterpoint::estimation
