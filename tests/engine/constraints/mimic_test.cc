// Mimic joints: followers keep to their masters, and the inverse accounts for it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "support/linkages.h"
#include "support/paths.h"
#include "support/recover.h"

namespace counterpoint::mimic_test {
namespace {

using test::kRecovered;
using test::recover;
using test::simulate;

/// A gripper of two fingers, the second following the first, under random forces.
TEST(Mimic, IsRecoveredByTheInverse) {
  RobotSpec robot;
  robot.name = "gripper";
  LinkSpec base;
  base.name = "base";
  robot.links.push_back(base);
  for (int i = 0; i < 2; ++i) {
    LinkSpec link;
    link.name = "finger" + std::to_string(i);
    link.inertia = {0.1, Vector3(0, 0, 0.05), 1e-4 * Matrix3::Identity()};
    robot.links.push_back(link);
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = "base";
    joint.child = link.name;
    joint.axis = Vector3::UnitY();
    if (i == 1) {
      joint.mimic_master = "joint0";
      joint.mimic_multiplier = -1.0;
    }
    robot.joints.push_back(joint);
  }
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  Simulator sim = simulate(builder.build());
  test::Random random(5);
  double apart = 0.0;
  EXPECT_LT(
      recover(sim, 500, 0.1, random,
              [&] { apart = std::max(apart, std::abs(sim.state().q[0] + sim.state().q[1])); }),
      kRecovered);
  EXPECT_LT(apart, 1e-6);
}

/// The gripper of the Panda model (shared data) under random forces on all joints.
TEST(Mimic, PandasFingersKeepTogether) {
  const std::filesystem::path file =
      std::filesystem::path(test::shared_data()) /
      "robots/panda_primitives/panda_description/urdf/panda_collision.urdf";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing";
  Simulator sim(load_scene(file));
  ASSERT_FALSE(sim.model().mimics().empty());
  test::Random random(7);
  double apart = 0.0;
  const auto look = [&] {
    for (const Mimic& mimic : sim.model().mimics()) {
      const auto q = [&](int joint) { return sim.state().q[sim.model().body(joint + 1).q_index]; };
      apart = std::max(
          apart, std::abs(q(mimic.joint) - mimic.multiplier * q(mimic.master) - mimic.offset));
    }
  };
  // Fingers of 15 g on joints rated for 20 N: 0.5 N gives 30 m/s^2.
  EXPECT_LT(recover(sim, 2000, 0.5, random, look), kRecovered);
  EXPECT_LT(apart, 1e-6);  // [m]
}

}  // namespace
}  // namespace counterpoint::mimic_test
