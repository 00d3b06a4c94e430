// Closures from the builder and from scene files: omitted values follow from the start
// configuration; errors are reported with their line.
#include <gtest/gtest.h>

#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::closures_test {
namespace {

constexpr double kRoundoff = 1e-14;

class ClosureScene : public testing::Test {
 protected:
  /// Two boxes 0.5 m apart, the second rotated, a ground, and the given closures.
  Scene load(const std::string& closures) const {
    return load_scene(folder_.write("scene.yaml", R"(ground: {}
models:
  - {name: a, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 1]}
  - {name: b, box: [0.1, 0.1, 0.1], mass: 2, position: [0.5, 0, 1], rpy: [0, 0, 1.5707963267948966]}
closures:
)" + closures));
  }
  void expect_refused(const std::string& closures, const std::vector<std::string>& parts) const {
    SCOPED_TRACE(closures);
    try {
      load(closures);
      ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
      for (const std::string& part : parts)
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
  test::TempFolder folder_;
};

TEST_F(ClosureScene, WhatIsLeftOpenFollowsFromTheStart) {
  const Scene scene = load(R"(
  - {type: ball, between: [a/body, b/body], name: hinge, anchor_a: [0.2, 0, 0]}
  - {type: weld, between: [a/body, b/body]}
  - {type: distance, between: [world, b/body], anchor_a: [0.5, 0, 3]}
)");
  const auto& closures = scene.model.closures();
  ASSERT_EQ(closures.size(), 3u);
  EXPECT_EQ(closures[0].name, "hinge");
  EXPECT_EQ(closures[0].type, ClosureType::kBall);
  EXPECT_EQ(closures[0].body_a, 1);
  EXPECT_EQ(closures[0].body_b, 2);
  // 0.3 m from b's centre, in axes rotated by a right angle.
  EXPECT_LT((closures[0].X_BC.translation - Vector3(0, 0.3, 0)).norm(), kRoundoff);
  EXPECT_EQ(closures[1].name, "closure1");
  EXPECT_EQ(closures[2].body_a, 0);
  EXPECT_NEAR(closures[2].length, 2.0, kRoundoff);
  const std::vector<Pose> X_WB = body_poses(scene.model, scene.q);
  for (const Closure& closure : closures) {
    EXPECT_NEAR(closure_gap(closure, X_WB).distance, 0.0, kRoundoff);
    EXPECT_NEAR(closure_gap(closure, X_WB).angle, 0.0, 1e-7);  // round-off of acos near one
  }
  EXPECT_TRUE(scene.model.notes().empty());
}

TEST_F(ClosureScene, AxesPitchAndSpringsAreTaken) {
  const Scene scene = load(R"(  - {type: hinge, between: [world, a/body], axis: [0, 3, 0]}
  - {type: screw, between: [a/body, b/body], axis: [1, 0, 0], pitch: -0.1}
  - {type: weld, between: [world, b/body], stiffness: 5, damping: [1, 2, 0], rotational_stiffness: [0, 0, 3]}
  - {type: distance, between: [world, b/body], anchor_a: [0, 0, 9], rope: true}
)");
  const auto& closures = scene.model.closures();
  ASSERT_EQ(closures.size(), 4u);
  EXPECT_LT((closures[0].X_AC.rotation.col(2) - Vector3::UnitY()).norm(), kRoundoff);
  EXPECT_LT((closures[1].X_AC.rotation.col(2) - Vector3::UnitX()).norm(), kRoundoff);
  EXPECT_EQ(closures[1].pitch, -0.1);
  EXPECT_TRUE(closures[2].linear.acts && closures[2].angular.acts && !closures[0].linear.acts);
  EXPECT_EQ(closures[2].linear.stiffness, Vector3(5, 5, 5));
  EXPECT_EQ(closures[2].linear.damping, Vector3(1, 2, 0));
  EXPECT_EQ(closures[2].angular.stiffness, Vector3(0, 0, 3));
  EXPECT_TRUE(closures[3].rope);
  const int rows[] = {5, 5, 4, 1};
  const std::vector<Pose> X_WB = body_poses(scene.model, scene.q);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(num_rows(closures[i]), rows[i]);
    EXPECT_LT(closure_gap(closures[i], X_WB).largest(), 1e-7);  // round-off of acos near one
    EXPECT_NEAR(spring_energy(closures[i], X_WB), 0.0, kRoundoff);
  }
}

TEST_F(ClosureScene, WhatIsGivenIsTakenAndAnOpenStartIsNoted) {
  const Scene scene = load(R"(
  - {type: weld, between: [a/body, b/body], anchor_a: [0.1, 0, 0], anchor_b: [-0.1, 0, 0], rpy: [0, 0, 0]}
  - {type: distance, between: [a/body, b/body], length: 0.4}
)");
  const auto& closures = scene.model.closures();
  const std::vector<Pose> X_WB = body_poses(scene.model, scene.q);
  EXPECT_NEAR(closure_gap(closures[0], X_WB).angle, 1.5707963267948966, 1e-12);
  EXPECT_NEAR(closure_gap(closures[1], X_WB).distance, 0.1, kRoundoff);
  ASSERT_EQ(scene.model.notes().size(), 2u);
  EXPECT_NE(scene.model.notes()[0].where.find("scene.yaml:7"), std::string::npos)
      << scene.model.notes()[0].where;
  EXPECT_NE(scene.model.notes()[1].message.find("0.1 m"), std::string::npos);
}

/// The internal states of switched closures: attached or not, and the pose that a weld in place
/// holds, which is the start pose at first. A closure that starts open is not noted.
TEST_F(ClosureScene, SwitchedClosuresHaveInternalStates) {
  const Scene scene = load(R"(
  - {type: ball, between: [a/body, b/body]}
  - {type: ball, between: [a/body, b/body], anchor_b: [1, 0, 0], switched: true, attached: false}
  - {type: weld, between: [a/body, b/body], switched: true, in_place: true, breaking_force: 3}
)");
  const auto& closures = scene.model.closures();
  ASSERT_EQ(scene.model.nz(), 9);
  EXPECT_EQ(closures[1].z_index, 0);
  EXPECT_EQ(closures[2].z_index, 1);
  EXPECT_EQ(closures[2].breaking_force, 3.0);
  const VectorX& z = scene.model.default_z();
  EXPECT_EQ(z[0], Closure::kReleased);
  EXPECT_EQ(z[1], Closure::kAttached);
  EXPECT_LT((z.segment<3>(2) - Vector3(0.5, 0, 0)).norm(), kRoundoff);
  EXPECT_TRUE(scene.model.notes().empty());
  const std::vector<Pose> X_WB = body_poses(scene.model, scene.q);
  EXPECT_EQ(closure_gap(closures[1], X_WB, z).largest(), 0.0);
  EXPECT_LT(closure_gap(closures[2], X_WB, z).largest(), 1e-7);  // round-off of acos near one
}

TEST_F(ClosureScene, JoinedBodiesDoNotCollideUnlessTold) {
  const auto excluded = [&](const std::string& closure) {
    return load(closure).model.excluded_geometry_pairs();
  };
  const std::vector<std::pair<int, int>> none, both{{0, 1}};
  EXPECT_EQ(excluded("  - {type: ball, between: [b/body, a/body]}\n"), both);
  EXPECT_EQ(excluded("  - {type: ball, between: [a/body, b/body], collide: true}\n"), none);
  // Its bodies meet while it is open.
  EXPECT_EQ(excluded("  - {type: ball, between: [a/body, b/body], switched: true}\n"), none);
  // A body connected to the world still collides with the ground.
  EXPECT_EQ(excluded("  - {type: ball, between: [world, b/body]}\n"), none);
}

TEST_F(ClosureScene, MistakesAreRefusedWhereTheyStand) {
  expect_refused("  - {type: glue, between: [a/body, b/body]}\n",
                 {"scene.yaml:6", "'glue' is not one of ball, weld, distance, hinge"});
  expect_refused("  - {type: ball, between: [a/body]}\n", {"scene.yaml:6", "two links"});
  expect_refused("  - {type: ball, between: [a/body, c]}\n",
                 {"scene.yaml:6", "there is no link 'c'", "'world', 'a/body', 'b/body'"});
  expect_refused("  - {type: ball, between: [a/body, a/body]}\n",
                 {"scene.yaml:6", "one rigid body"});
  expect_refused("  - {type: ball, between: [a/body, b/body], length: 1}\n",
                 {"scene.yaml:6", "length is for a distance"});
  expect_refused("  - {type: ball, between: [a/body, b/body], rpy: [0, 0, 1]}\n",
                 {"scene.yaml:6", "holds angles, not for a ball"});
  expect_refused("  - {type: distance, between: [a/body, b/body], length: 0}\n",
                 {"scene.yaml:6", "not positive"});
  expect_refused(
      "  - {type: distance, between: [a/body, b/body], anchor_a: [0, 0, 0], anchor_b: [0, 0.5, "
      "0]}\n",
      {"scene.yaml:6", "start at one point"});
  const auto refuse = [&](const std::string& keys, const std::string& part) {
    expect_refused("  - {between: [a/body, b/body], " + keys + "}\n", {"scene.yaml:6", part});
  };
  refuse("type: weld, axis: [0, 0, 1]", "a weld has no axis");
  refuse("type: hinge, axis: [0, 0, 0]", "other than zero");
  refuse("type: screw", "needs its pitch");
  refuse("type: screw, pitch: 0", "other than zero");
  refuse("type: hinge, pitch: 1", "for a screw only");
  refuse("type: hinge, rope: true", "only a distance can be a rope");
  refuse("type: ball, stiffness: -1", "not negative");
  refuse("type: ball, attached: false", "for a switched closure");
  refuse("type: weld, in_place: true", "for a switched closure");
  refuse("type: weld, breaking_force: 3", "for a switched closure");
  refuse("type: ball, switched: true, in_place: true", "only a weld can hold in place");
  refuse("type: ball, switched: true, breaking_torque: 3", "carries no torque");
  refuse("type: ball, switched: true, breaking_force: 0", "not positive");
  refuse("type: ball, switched: maybe", "true or false");
  refuse("type: ball, stiffness: 0", "holds nothing");
  refuse("type: ball, stiffness: [1, 2]", "stiffness");
  refuse("type: slider, rotational_damping: 1", "holds no angle");
  refuse("type: screw, pitch: 1, damping: 1", "a screw is rigid");
  refuse("type: distance, stiffness: [1, 2, 3]", "not one per axis");
  expect_refused("  - {type: ball, between: [a/body, b/body], anchor: [0, 0, 1]}\n",
                 {"scene.yaml:6", "anchor_a"});
  expect_refused(
      "  - {type: ball, name: x, between: [a/body, b/body]}\n"
      "  - {type: weld, name: x, between: [a/body, b/body]}\n",
      {"scene.yaml:7", "already a closure"});
}

}  // namespace
}  // namespace counterpoint::closures_test
