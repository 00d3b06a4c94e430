#include "counterpoint/engine/estimate/sensors/sensor.h"

namespace counterpoint::estimation {

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

}  // namespace counterpoint::estimation
