#pragma once
// An arm of two joints for ModelBuilder; tests spoil it in one place.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "counterpoint/model/model_builder.h"

namespace counterpoint::test {

inline LinkSpec make_link(const std::string& name, double mass, double moment = 0.1) {
  LinkSpec link;
  link.name = name;
  link.inertia.mass = mass;
  link.inertia.rotational = moment * Matrix3::Identity();
  return link;
}

inline JointSpec make_joint(const std::string& name, const std::string& parent,
                            const std::string& child, JointType type = JointType::kRevolute) {
  JointSpec joint;
  joint.name = name;
  joint.parent = parent;
  joint.child = child;
  joint.type = type;
  return joint;
}

inline RobotSpec make_arm() {
  RobotSpec robot;
  robot.name = "arm";
  robot.links = {make_link("base", 1), make_link("upper", 1), make_link("lower", 1)};
  robot.joints = {make_joint("shoulder", "base", "upper"), make_joint("elbow", "upper", "lower")};
  return robot;
}

inline Model build(const RobotSpec& robot, Base base = Base::kFixed,
                   const std::string& prefix = "") {
  ModelBuilder builder;
  builder.add_robot(robot, base, Pose(), prefix);
  return builder.build();
}

/// Expects that building throws an InputError whose message contains every one of `parts`.
inline void expect_refused(const RobotSpec& robot, const std::vector<std::string>& parts,
                           Base base = Base::kFixed) {
  try {
    build(robot, base);
  } catch (const InputError& error) {
    for (const std::string& part : parts) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos)
          << "'" << part << "' is missing in: " << error.what();
    }
    return;
  }
  ADD_FAILURE() << "accepted; expected a refusal mentioning " << parts.front();
}

}  // namespace counterpoint::test
