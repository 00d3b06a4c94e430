// A wheel that an actuator drives.
#pragma once

#include <string>

#include "counterpoint/model/scene.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::test {

inline constexpr double kWheelInertia = 0.5;  // about its axis [kg m^2]

inline Actuator named(const std::string& name) {
  Actuator a;
  a.name = name;
  return a;
}

/// A wheel, link "disk", on a revolute joint "axle" about the world's z axis, with an actuator on
/// the joint or on the disk; steps of 2 ms, without gravity.
inline Scene wheel(const Actuator& actuator, double upper = kInfinity) {
  RobotSpec robot;
  robot.name = "robot";
  LinkSpec base, disk;
  base.name = "base";
  disk.name = "disk";
  disk.inertia.mass = 1.0;
  disk.inertia.rotational = kWheelInertia * Matrix3::Identity();
  robot.links = {base, disk};
  JointSpec joint;
  joint.name = "axle";
  joint.parent = "base";
  joint.child = "disk";
  joint.axis = Vector3::UnitZ();
  joint.upper = upper;
  robot.joints = {joint};
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFixed, Pose());
  builder.add_actuator({actuator, "axle", "", "disk", ""});
  return scene_of(builder.build());
}

}  // namespace counterpoint::test
