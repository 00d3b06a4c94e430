#include <gtest/gtest.h>

#include <numbers>

#include "counterpoint/model/model.h"
#include "counterpoint/model/model_builder.h"
#include "support/arm_spec.h"
#include "support/random_model.h"

namespace counterpoint::builder_test {
namespace {

using test::build;
using test::expect_refused;
using test::make_arm;
using test::make_joint;
using test::make_link;

// Sums and products of numbers of order one: a few units of round-off.
constexpr double kRoundoff = 1e-13;

TEST(Builder, MergesFixedLinksAsOneRigidBody) {
  RobotSpec robot;
  robot.links = {make_link("a", 2), make_link("b", 3)};
  robot.links[0].inertia.center = {0.1, 0.2, 0.3};
  robot.links[1].inertia.center = {-0.1, 0.0, 0.5};
  robot.links[1].inertia.rotational = Vector3(0.1, 0.2, 0.25).asDiagonal();
  robot.links[1].collisions.push_back({"ball", Pose{Matrix3::Identity(), {0, 0, 1}},
                                       Shape{ShapeType::kSphere, {0.1, 0, 0}, nullptr},
                                       Material()});
  robot.joints = {make_joint("weld", "a", "b")};
  robot.joints[0].fixed = true;
  robot.joints[0].X_PJ = {rotation_from_rpy(0, 0, std::numbers::pi / 2), {1, 0, 0}};
  const Model model = build(robot, Base::kFloating);

  ASSERT_EQ(model.num_bodies(), 2);
  const SpatialInertia& merged = model.body(1).inertia;
  // Expected values: b is rotated by 90 degrees about z and translated by 1 m along x.
  const Vector3 cb(1.0, -0.1, 0.5);
  const Vector3 c = (2.0 * Vector3(0.1, 0.2, 0.3) + 3.0 * cb) / 5.0;
  EXPECT_EQ(merged.mass, 5.0);
  EXPECT_LT((merged.center - c).norm(), kRoundoff);
  const auto about = [&](double m, const Vector3& p) -> Matrix3 {
    const Vector3 d = p - c;
    return m * (d.squaredNorm() * Matrix3::Identity() - d * d.transpose());
  };
  Matrix3 turned = Matrix3::Zero();
  turned.diagonal() << 0.2, 0.1, 0.25;
  const Matrix3 expected =
      0.1 * Matrix3::Identity() + turned + about(2.0, Vector3(0.1, 0.2, 0.3)) + about(3.0, cb);
  EXPECT_LT((merged.rotational - expected).norm(), kRoundoff);

  ASSERT_EQ(model.frames().size(), 2u);
  EXPECT_EQ(model.frames()[1].name, "b");
  EXPECT_EQ(model.frames()[1].body, 1);
  ASSERT_EQ(model.geometries().size(), 1u);
  EXPECT_EQ(model.geometries()[0].name, "b/ball");
  EXPECT_LT((model.geometries()[0].X_BG.translation - Vector3(1, 0, 1)).norm(), kRoundoff);
}

TEST(Builder, FixedBaseMergesIntoTheWorldAndKeepsItsInstance) {
  RobotSpec robot = make_arm();
  robot.links[0].collisions.push_back(
      {"", Pose(), Shape{ShapeType::kBox, {1, 1, 1}, nullptr}, Material()});
  ModelBuilder builder;
  builder.add_robot(make_arm(), Base::kFloating, Pose(), "first/");
  builder.add_robot(robot, Base::kFixed, Pose{Matrix3::Identity(), {0, 0, 2}}, "second/");
  const Model model = builder.build();
  ASSERT_EQ(model.geometries().size(), 1u);
  EXPECT_EQ(model.geometries()[0].name, "second/base/0");
  EXPECT_EQ(model.geometries()[0].body, 0);
  EXPECT_EQ(model.geometries()[0].instance, 1);
  EXPECT_EQ(model.geometries()[0].X_BG.translation, Vector3(0, 0, 2));
  EXPECT_EQ(model.body(0).inertia.mass, 0.0);
  EXPECT_EQ(model.num_trees(), 2);
}

TEST(Builder, TurnsBodyFramesSoThatTheAxisIsZ) {
  RobotSpec robot = make_arm();
  robot.joints[0].axis = Vector3(1, 2, -2);  // not a unit vector: is normalized
  robot.joints[0].X_PJ = {rotation_from_rpy(0.1, 0.2, 0.3), {1, 2, 3}};
  const Model model = build(robot);
  const Body& upper = model.body(1);
  const Vector3 axis_in_parent = robot.joints[0].X_PJ.rotation * Vector3(1, 2, -2) / 3.0;
  EXPECT_LT((upper.X_PJ.rotation.col(2) - axis_in_parent).norm(), kRoundoff);
  EXPECT_EQ(upper.X_PJ.translation, Vector3(1, 2, 3));
  // At q = 0 the link frame is at its pose in the URDF.
  const Pose X_WL = upper.X_PJ * model.frames()[model.find_frame("upper")].X_BF;
  EXPECT_LT((X_WL.rotation - robot.joints[0].X_PJ.rotation).norm(), kRoundoff);
  EXPECT_LT((X_WL.translation - Vector3(1, 2, 3)).norm(), kRoundoff);
}

TEST(Builder, OrdersBodiesDepthFirstWithContiguousSubtrees) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test::RandomModelOptions options;
    options.links = 30;
    options.robots = 2;
    options.base = seed % 2 == 0 ? Base::kFixed : Base::kFloating;
    const Model model = test::make_random_model(seed, options);
    int q = 0;
    int v = 0;
    EXPECT_EQ(model.body(0).subtree_end, model.num_bodies());
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      EXPECT_LT(body.parent, i);
      EXPECT_EQ(body.q_index, q);
      EXPECT_EQ(body.v_index, v);
      q += joint_nq(body.joint_type);
      v += joint_nv(body.joint_type);
      // A later body is in the subtree exactly if its parent is in it or is its root.
      for (int k = i + 1; k < model.num_bodies(); ++k) {
        const int p = model.body(k).parent;
        const bool below = p == i || (p > i && p < body.subtree_end);
        EXPECT_EQ(k < body.subtree_end, below);
      }
      const Tree& tree = model.trees()[body.tree];
      EXPECT_TRUE(i >= tree.body_begin && i < tree.body_end);
      EXPECT_TRUE(body.parent == 0 ? i == tree.body_begin
                                   : model.body(body.parent).tree == body.tree);
    }
    EXPECT_EQ(q, model.nq());
    EXPECT_EQ(v, model.nv());
  }
}

TEST(Builder, ChildrenFollowTheOrderOfTheirJoints) {
  RobotSpec robot;
  for (const char* name : {"root", "c", "b", "a", "c2"}) robot.links.push_back(make_link(name, 1));
  robot.joints = {make_joint("j_b", "root", "b"), make_joint("j_c2", "c", "c2"),
                  make_joint("j_c", "root", "c"), make_joint("j_a", "root", "a")};
  const Model model = build(robot, Base::kFloating);
  std::vector<std::string> links;
  for (const JointInfo& joint : model.joints()) links.push_back(joint.link);
  EXPECT_EQ(links, (std::vector<std::string>{"root", "b", "c", "c2", "a"}));
  EXPECT_EQ(model.joint(0).name, "root");
  EXPECT_FALSE(model.joint(0).actuated);
  EXPECT_TRUE(model.joint(1).actuated);
}

TEST(Builder, SameInputGivesSameModel) {
  const Model a = test::make_random_model(3);
  const Model b = test::make_random_model(3);
  ASSERT_EQ(a.num_bodies(), b.num_bodies());
  for (int i = 0; i < a.num_bodies(); ++i) {
    EXPECT_EQ(a.body(i).X_PJ.rotation, b.body(i).X_PJ.rotation);
    EXPECT_EQ(a.body(i).inertia.rotational, b.body(i).inertia.rotational);
  }
}

TEST(Builder, DefaultsObeyLimitsAndMimics) {
  RobotSpec robot = make_arm();
  robot.joints[0].lower = 0.5;
  robot.joints[0].upper = 1.0;
  robot.joints[1].mimic_master = "shoulder";
  robot.joints[1].mimic_multiplier = -2.0;
  robot.joints[1].mimic_offset = 0.25;
  const Model model = build(robot);
  EXPECT_EQ(model.default_q()[0], 0.5);
  EXPECT_EQ(model.default_q()[1], -0.75);
  ASSERT_EQ(model.notes().size(), 1u);
  EXPECT_NE(model.notes()[0].message.find("0.5"), std::string::npos);
  ASSERT_EQ(model.mimics().size(), 1u);
  EXPECT_EQ(model.mimics()[0].joint, 1);
  EXPECT_EQ(model.mimics()[0].master, 0);
}

TEST(Builder, SetsDefaultPositions) {
  ModelBuilder builder;
  builder.add_robot(make_arm(), Base::kFloating, Pose{Matrix3::Identity(), {1, 2, 3}});
  VectorX q(7);
  q << 4, 5, 6, 0, 0, 0, 2;
  builder.set_default_position("base", q);
  EXPECT_THROW(builder.set_default_position("wrist", VectorX::Zero(1)), InputError);
  EXPECT_THROW(builder.set_default_position("elbow", VectorX::Zero(2)), InputError);
  EXPECT_THROW(builder.set_default_position("base", VectorX::Zero(7)), InputError);
  const Model model = builder.build();
  q[6] = 1;
  EXPECT_EQ(model.default_q().head<7>(), q);
}

TEST(Builder, ExcludesPairsOfGeometriesAndLinks) {
  RobotSpec robot = make_arm();
  const Shape ball{ShapeType::kSphere, {0.1, 0, 0}, nullptr};
  robot.links[1].collisions = {{"p", Pose(), ball, Material()}, {"p", Pose(), ball, Material()}};
  robot.links[2].collisions = {{"", Pose(), ball, Material()}};
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  const int ground =
      builder.add_environment("ground", Shape{ShapeType::kPlane, {}, nullptr}, Pose(), Material());
  builder.exclude_pair("lower", "upper");
  builder.exclude_pair("upper", "lower");
  builder.exclude_pair("ground", "lower/0");
  EXPECT_THROW(builder.exclude_pair("ground", "nothing"), InputError);
  EXPECT_THROW(builder.add_environment("ground", ball, Pose(), Material()), InputError);
  const Model model = builder.build();
  EXPECT_EQ(ground, 3);
  EXPECT_EQ(model.geometries()[1].name, "upper/p:1");
  EXPECT_EQ(model.excluded_geometry_pairs(),
            (std::vector<std::pair<int, int>>{{0, 2}, {1, 2}, {2, 3}}));
}

TEST(BuilderRefuses, WhatIsNoTree) {
  RobotSpec robot = make_arm();
  robot.joints[1].child = "hand";
  expect_refused(robot, {"elbow", "hand", "does not exist"});
  robot = make_arm();
  robot.joints.push_back(make_joint("extra", "base", "lower"));
  expect_refused(robot, {"extra", "lower", "elbow"});
  robot = make_arm();
  robot.joints.pop_back();
  expect_refused(robot, {"lower", "base", "one root"});
  robot = make_arm();
  robot.joints.push_back(make_joint("extra", "lower", "base"));
  expect_refused(robot, {"loop"});
  robot = make_arm();
  robot.links.push_back(make_link("x", 1));
  robot.links.push_back(make_link("y", 1));
  robot.joints.push_back(make_joint("xy", "x", "y"));
  robot.joints.push_back(make_joint("yx", "y", "x"));
  expect_refused(robot, {"'x'", "loop", "base"});
  expect_refused(RobotSpec(), {"no link"});
}

TEST(BuilderRefuses, WrongValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuse = [](auto change, const std::vector<std::string>& parts) {
    RobotSpec robot = make_arm();
    robot.joints[1].where = "arm.urdf:12";
    change(robot);
    expect_refused(robot, parts);
  };
  refuse([&](RobotSpec& r) { r.links[1].inertia.mass = nan; }, {"upper", "finite"});
  refuse([&](RobotSpec& r) { r.links[1].inertia.mass = -1; }, {"upper", "-1"});
  refuse([&](RobotSpec& r) { r.joints[1].axis.setZero(); }, {"arm.urdf:12", "elbow", "axis"});
  refuse([&](RobotSpec& r) { r.joints[1].axis[0] = nan; }, {"elbow", "axis"});
  refuse([&](RobotSpec& r) { r.joints[1].X_PJ.translation[0] = nan; }, {"elbow", "finite"});
  refuse([&](RobotSpec& r) { r.joints[1].X_PJ.rotation *= 2; }, {"elbow", "rotation"});
  refuse([&](RobotSpec& r) { r.joints[1].lower = 1, r.joints[1].upper = 0; }, {"elbow", "above"});
  refuse([&](RobotSpec& r) { r.joints[1].upper = nan; }, {"elbow", "limit"});
  refuse([&](RobotSpec& r) { r.joints[1].damping = -1; }, {"elbow", "damping"});
  refuse([&](RobotSpec& r) { r.joints[1].armature = nan; }, {"elbow", "armature"});
  refuse([&](RobotSpec& r) { r.joints[1].mimic_master = "knee"; }, {"elbow", "knee"});
  refuse([&](RobotSpec& r) { r.joints[1].mimic_master = "elbow"; }, {"elbow", "itself"});
  refuse([&](RobotSpec& r) { r.joints[1].name = "shoulder"; }, {"shoulder", "two joints"});
  refuse([&](RobotSpec& r) { r.links[1].name = "base"; }, {"base", "two links"});
  const auto with_shape = [&](const Shape& shape, const std::vector<std::string>& parts) {
    refuse(
        [&](RobotSpec& r) {
          r.links[2].collisions = {{"c", Pose(), shape, Material()}};
        },
        parts);
  };
  with_shape({ShapeType::kSphere, {0, 0, 0}, nullptr}, {"lower", "radius"});
  with_shape({ShapeType::kBox, {1, nan, 1}, nullptr}, {"lower", "box"});
  with_shape({ShapeType::kConvexMesh, {1, 1, 1}, nullptr}, {"lower", "mesh"});
  with_shape({ShapeType::kPlane, {}, nullptr}, {"lower", "plane"});
}

TEST(BuilderRefuses, TakenNames) {
  ModelBuilder builder;
  builder.add_robot(make_arm(), Base::kFixed, Pose(), "a/");
  EXPECT_NO_THROW(builder.add_robot(make_arm(), Base::kFixed, Pose(), "b/"));
  EXPECT_THROW(builder.add_robot(make_arm(), Base::kFixed, Pose(), "a/"), InputError);
}

TEST(Builder, RefusesSpringsServosAndDragThatCannotBe) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto change, const std::vector<std::string>& parts) {
    RobotSpec robot = make_arm();
    change(robot.joints[1], robot.links[1]);
    expect_refused(robot, parts);
  };
  refused([](JointSpec& j, LinkSpec&) { j.stiffness = -1; }, {"elbow", "stiffness", "-1"});
  refused([&](JointSpec& j, LinkSpec&) { j.reference = nan; }, {"elbow", "finite"});
  refused([](JointSpec& j, LinkSpec&) { j.servo.damping = -1; }, {"elbow", "servo"});
  refused([&](JointSpec& j, LinkSpec&) { j.servo.position = nan; }, {"elbow", "finite"});
  refused([](JointSpec& j, LinkSpec&) { j.effort_limit = -1; }, {"elbow", "effort"});
  refused([](JointSpec& j, LinkSpec&) { j.velocity_limit = 0; }, {"elbow", "velocity"});
  refused([](JointSpec& j, LinkSpec&) { j.type = JointType::kPlanar, j.stiffness = 1; },
          {"elbow", "planar", "spring"});
  refused([](JointSpec& j, LinkSpec&) { j.type = JointType::kSpherical, j.servo.stiffness = 1; },
          {"elbow", "spherical", "servo"});
  refused([](JointSpec& j, LinkSpec&) { j.mimic_master = "shoulder", j.servo.stiffness = 1; },
          {"elbow", "shoulder"});
  refused([&](JointSpec&, LinkSpec& l) { l.drag.quadratic = nan; }, {"upper", "quadratic drag"});
  refused([&](JointSpec&, LinkSpec& l) { l.gravity_compensation = nan; },
          {"upper", "gravity_compensation"});
}

}  // namespace
}  // namespace counterpoint::builder_test
