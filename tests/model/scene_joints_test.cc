// Keys of a scene file for joints and for drag of links that go beyond the robot's own file.
#include <gtest/gtest.h>

#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::scene_joints_test {
namespace {

/// A slide, an independent hinge with limits, a follower, a fixed sensor, a ball.
const char* const kRobot = R"(<robot name="robot"><link name="base"/>
<link name="a"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="b"><inertial><origin xyz="0 0 0.5"/><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="c"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="d"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="e"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="0" velocity="-1"/><dynamics damping="3" friction="4"/></joint>
<joint name="hinge" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="0.2" upper="1" effort="7" velocity="5"/></joint>
<joint name="follower" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/><mimic joint="hinge"/></joint>
<joint name="weld" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0 0 1"/></joint>
<joint name="socket" type="spherical"><parent link="d"/><child link="e"/></joint>
</robot>)";

class SceneJoints : public testing::Test {
 protected:
  SceneJoints() { folder_.write("robot.urdf", kRobot); }
  /// A scene of this robot with more keys, each indented by four spaces.
  Scene load(const std::string& keys) const {
    return load_scene(folder_.write("scene.yaml", "models:\n  - urdf: robot.urdf\n" + keys));
  }
  void expect_refused(const std::string& keys, int line,
                      const std::vector<std::string>& parts) const {
    SCOPED_TRACE(keys);
    try {
      load(keys);
      ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("scene.yaml:" + std::to_string(line) + ":"), std::string::npos)
          << message;
      for (const std::string& part : parts)
        EXPECT_NE(message.find(part), std::string::npos) << part << " is missing in: " << message;
    }
  }
  test::TempFolder folder_;
};

constexpr int kSlide = 0, kHinge = 1, kFollower = 2, kSocket = 3;
constexpr double kNone = std::numeric_limits<double>::infinity();

TEST_F(SceneJoints, FrictionAtRestAndItsSpeed) {
  const Model model = load(R"(    dynamics:
      all: {breakaway_friction: 6, stribeck_speed: 0.2}
      hinge: {dry_friction: 1, breakaway_friction: 2}
)")
                          .model;
  EXPECT_EQ(model.breakaway_friction(), (VectorX(6) << 6, 2, 6, 6, 6, 6).finished());
  EXPECT_EQ(model.dry_friction(), (VectorX(6) << 4, 1, 0, 0, 0, 0).finished());
  EXPECT_EQ(model.stribeck_speed(), VectorX::Constant(6, 0.2));
  EXPECT_TRUE(model.breaks_away(0));
}

TEST_F(SceneJoints, NamedJointsGoBeforeAllAndBothBeforeTheFile) {
  const Scene scene = load(R"(    dynamics:
      hinge: {damping: 0.5, stiffness: 40, reference: 0.3, effort_limit: none, velocity_limit: 2,
              servo: {stiffness: 10, position: 0.8}}
      all: {damping: 0.1, armature: 0.01, stiffness: 20, servo: {damping: 2, velocity: 0.4}}
      slide: {dry_friction: 1, effort_limit: 9}
)");
  const Model& model = scene.model;
  // slide, hinge, follower, three of the ball.
  EXPECT_EQ(model.damping(), (VectorX(6) << 0.1, 0.5, 0.1, 0.1, 0.1, 0.1).finished());
  EXPECT_EQ(model.armature(), VectorX::Constant(6, 0.01));
  EXPECT_EQ(model.dry_friction(), (VectorX(6) << 1, 0, 0, 0, 0, 0).finished());
  EXPECT_EQ(model.joint(kSlide).effort_limit, 9.0);
  EXPECT_EQ(model.joint(kHinge).effort_limit, kNone);
  EXPECT_EQ(model.joint(kHinge).velocity_limit, 2.0);
  EXPECT_EQ(model.joint(kSocket).effort_limit, kNone);

  ASSERT_EQ(model.springs().size(), 3u);
  EXPECT_EQ(model.springs()[0].joint, kSlide);
  EXPECT_EQ(model.springs()[0].stiffness, 20.0);
  EXPECT_EQ(model.springs()[1].joint, kHinge);
  EXPECT_EQ(model.springs()[1].stiffness, 40.0);
  EXPECT_EQ(model.springs()[1].reference, 0.3);
  EXPECT_EQ(model.springs()[2].joint, kFollower);

  // A follower has no servo of its own.
  ASSERT_EQ(model.servos().size(), 2u);
  const JointServo& slide = model.servos()[0];
  EXPECT_EQ(slide.joint, kSlide);
  EXPECT_EQ(slide.stiffness, 0.0);
  EXPECT_EQ(slide.damping, 2.0);
  EXPECT_EQ(slide.velocity, 0.4);
  const JointServo& hinge = model.servos()[1];
  EXPECT_EQ(hinge.stiffness, 10.0);
  EXPECT_EQ(hinge.damping, 2.0);
  EXPECT_EQ(hinge.position, 0.8);
  EXPECT_EQ(hinge.velocity, 0.4);
  EXPECT_EQ(model.find_servo(kHinge), 1);
  EXPECT_EQ(model.find_servo(kSocket), -1);
}

TEST_F(SceneJoints, ServosHoldTheStartUnlessTold) {
  const Scene scene = load(
      "    joints: {slide: 0.25}\n"
      "    dynamics: {all: {servo: {stiffness: 5}}}\n");
  ASSERT_EQ(scene.model.servos().size(), 2u);
  EXPECT_EQ(scene.model.servos()[0].position, 0.25);
  // Zero is outside the limits of the hinge, so it starts, and is held, at the nearest limit.
  EXPECT_EQ(scene.model.servos()[1].position, 0.2);
}

TEST_F(SceneJoints, ServoOfNoStrengthIsNone) {
  const Scene scene = load(R"(    dynamics:
      all: {servo: {stiffness: 5, damping: 1}}
      slide: {servo: {stiffness: 0, damping: 0}}
)");
  ASSERT_EQ(scene.model.servos().size(), 1u);
  EXPECT_EQ(scene.model.servos()[0].joint, kHinge);
}

TEST_F(SceneJoints, LimitsOfZeroInAUrdfAreNotGivenAndNotedOnce) {
  const Scene scene = load("");
  EXPECT_EQ(scene.model.joint(kSlide).effort_limit, kNone);
  EXPECT_EQ(scene.model.joint(kSlide).velocity_limit, kNone);
  EXPECT_EQ(scene.model.joint(kHinge).effort_limit, 7.0);
  EXPECT_EQ(scene.model.joint(kHinge).velocity_limit, 5.0);
  int effort = 0, velocity = 0;
  for (const Note& note : scene.model.notes()) {
    if (note.message.find("effort limits of zero") != std::string::npos) ++effort;
    if (note.message.find("velocity limits of zero") != std::string::npos) ++velocity;
    EXPECT_EQ(note.message.find("'follower'"), std::string::npos) << note.message;
  }
  EXPECT_EQ(effort, 1);
  EXPECT_EQ(velocity, 1);
  // In a scene file, a limit of zero is intended.
  const Scene limp = load("    dynamics: {slide: {effort_limit: 0}}\n");
  EXPECT_EQ(limp.model.joint(kSlide).effort_limit, 0.0);
}

TEST_F(SceneJoints, AnyJointBecomesABall) {
  const Scene scene =
      load("    joint_types: {hinge: spherical, weld: spherical, follower: spherical}\n");
  const Model& model = scene.model;
  ASSERT_EQ(model.num_joints(), 5);
  for (const int body : {2, 3, 4, 5}) EXPECT_EQ(model.body(body).joint_type, JointType::kSpherical);
  EXPECT_TRUE(model.mimics().empty());
  EXPECT_EQ(model.joint(kHinge).name, "hinge");
  EXPECT_EQ(model.joint(kHinge).effort_limit, kNone);
  EXPECT_EQ(model.joint(kHinge).upper, kNone);
  EXPECT_EQ(model.body(4).X_PJ.translation, Vector3(0, 0, 1));  // weld
  int notes = 0;
  for (const Note& note : model.notes())
    notes += note.message.find("ball joint") != std::string::npos;
  EXPECT_EQ(notes, 3);
}

TEST_F(SceneJoints, BaseOnABallJoint) {
  const Scene scene = load(
      "    base: spherical\n    position: [1, 2, 3]\n    quaternion: [0, 1, 0, 0]\n"
      "    velocity: {angular: [1, 2, 3]}\n");
  const Body& root = scene.model.body(1);
  EXPECT_EQ(root.joint_type, JointType::kSpherical);
  EXPECT_EQ(scene.model.joint(0).name, "base");
  EXPECT_FALSE(scene.model.joint(0).actuated);
  EXPECT_TRUE(scene.model.joint(4).actuated);  // the ball joint at the other end
  EXPECT_EQ(root.X_PJ.translation, Vector3(1, 2, 3));
  EXPECT_EQ(scene.v.head<3>(), Vector3(1, 2, 3));
  // The pose equals that of a welded base.
  const Scene welded = load("    position: [1, 2, 3]\n    quaternion: [0, 1, 0, 0]\n");
  const auto hanging = body_poses(scene.model, scene.q), fixed = body_poses(welded.model, welded.q);
  constexpr double kRoundoff = 1e-14;
  for (int i = 1; i < welded.model.num_bodies(); ++i) {
    EXPECT_LT((hanging[i + 1].translation - fixed[i].translation).norm(), kRoundoff);
    EXPECT_LT((hanging[i + 1].rotation - fixed[i].rotation).norm(), kRoundoff);
  }
}

TEST_F(SceneJoints, LinksMayCarryTheirWeight) {
  const Scene scene = load(R"(    gravity_compensation: {b: 1, d: 0.5, base: 1, e: 0}
)");
  // The base is fixed, e is excluded, and d is merged into c.
  const auto& all = scene.model.gravity_compensations();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].body, 2);
  EXPECT_EQ(all[1].body, 3);
  const Scene ball = load_scene(
      folder_.write("ball.yaml", "models: [{sphere: 0.1, mass: 4, gravity_compensation: 0.25}]"));
  ASSERT_EQ(ball.model.gravity_compensations().size(), 1u);
  EXPECT_EQ(ball.model.gravity_compensations()[0].mass, 1.0);
}

TEST_F(SceneJoints, DragActsAtTheCentreOfEachLink) {
  const Scene scene = load(R"(    drag:
      b: {linear: 1, quadratic: 2, angular: 3, angular_quadratic: 4}
      d: {linear: 5}
      base: {linear: 6}
      e: {}
)");
  const Model& model = scene.model;
  // The base is fixed, and e is excluded.
  ASSERT_EQ(model.drags().size(), 2u);
  const BodyDrag& b = model.drags()[0];
  EXPECT_EQ(b.body, 2);
  EXPECT_EQ(b.drag.linear, 1.0);
  EXPECT_EQ(b.drag.quadratic, 2.0);
  EXPECT_EQ(b.drag.angular, 3.0);
  EXPECT_EQ(b.drag.angular_quadratic, 4.0);
  const BodyDrag& d = model.drags()[1];
  EXPECT_EQ(d.body, 3);  // merged into c
  const std::vector<Pose> X_WB = body_poses(model, VectorX::Zero(model.nq()) + scene.q);
  const Vector3 center_B = X_WB[2] * b.center;
  const double angle = 0.2;  // start position of the hinge [rad]
  constexpr double kRoundoff = 1e-15;
  EXPECT_LT((center_B - 0.5 * Vector3(std::sin(angle), 0, std::cos(angle))).norm(), kRoundoff);
  const int frame = model.find_frame("d");
  const Vector3 center_d = model.frames()[frame].X_BF * Vector3(0.1, 0, 0);
  EXPECT_LT((d.center - center_d).norm(), kRoundoff);

  const Scene ball = load_scene(
      folder_.write("ball.yaml", "models: [{sphere: 0.1, mass: 1, drag: {quadratic: 0.3}}]"));
  ASSERT_EQ(ball.model.drags().size(), 1u);
  EXPECT_EQ(ball.model.drags()[0].drag.quadratic, 0.3);
}

TEST_F(SceneJoints, ErrorsNameLineAndWhatIsKnown) {
  const auto dynamics = [&](const std::string& text, const std::vector<std::string>& parts) {
    expect_refused("    dynamics:\n      " + text + "\n", 4, parts);
  };
  dynamics("hing: {damping: 1}", {"hing", "hinge", "socket"});
  dynamics("slide: {breakaway_friction: 3.5}", {"3.5", "below the dry_friction 4", "slide"});
  dynamics("all: {breakaway_friction: 3.5}", {"3.5", "below the dry_friction 4", "slide"});
  dynamics("hinge: {breakaway_friction: -1}", {"-1"});
  dynamics("hinge: {breakaway_friction: 1, stribeck_speed: 0}", {"positive"});
  dynamics("hinge: {dampin: 1}", {"dampin", "dry_friction", "servo"});
  dynamics("hinge: {damping: -1}", {"damping", "-1"});
  dynamics("hinge: {stiffness: stiff}", {"stiffness", "number"});
  dynamics("hinge: {servo: {kp: 1}}", {"kp", "stiffness"});
  dynamics("hinge: {servo: {stiffness: -1}}", {"-1"});
  dynamics("hinge: {velocity_limit: 0}", {"velocity_limit", "positive"});
  dynamics("hinge: {effort_limit: -2}", {"effort_limit", "-2"});
  dynamics("socket: {stiffness: 1}", {"socket", "spherical", "revolute"});
  dynamics("socket: {servo: {stiffness: 1}}", {"socket", "spherical"});
  dynamics("follower: {servo: {stiffness: 1}}", {"follower", "mimics joint 'hinge'"});
  dynamics("weld: {damping: 1}", {"weld", "fixed"});
  expect_refused("    joint_types: {hinge: ball}\n", 3, {"ball", "spherical"});
  expect_refused("    joint_types: {knee: spherical}\n", 3, {"knee", "hinge"});
  expect_refused("    joint_types: {hinge: spherical}\n", 2, {"follower", "hinge", "revolute"});
  expect_refused("    drag: {f: {linear: 1}}\n", 3, {"'f'", "links: base, a, b"});
  expect_refused("    drag: {a: {linar: 1}}\n", 3, {"linar", "quadratic"});
  expect_refused("    drag: {a: {linear: -1}}\n", 3, {"-1"});
  expect_refused("    base: hinged\n", 3, {"spherical"});
  expect_refused("    base: spherical\n    velocity: {linear: [1, 0, 0]}\n", 4, {"angular"});
  const auto refused = [&](const std::string& yaml, const std::string& part) {
    try {
      load_scene(folder_.write("object.yaml", yaml));
      ADD_FAILURE() << "accepted: " << yaml;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  refused("models: [{sphere: 1, mass: 1, dynamics: {all: {damping: 1}}}]", "no joints");
  folder_.write("lump.urdf", "<robot name='lump'><link name='lump'/></robot>");
  refused("models: [{urdf: lump.urdf, dynamics: {all: {damping: 1}}}]", "no joint takes it");
}

TEST_F(SceneJoints, ABallHasALimitOfItsRotation) {
  EXPECT_EQ(load("    dynamics: {socket: {rotation_limit: 0.5}}\n").model.joint(kSocket).upper,
            0.5);
  expect_refused("    dynamics: {hinge: {rotation_limit: 0.5}}\n", 3, {"a spherical joint"});
  expect_refused("    dynamics: {socket: {rotation_limit: 0}}\n", 3, {"positive"});
}

}  // namespace
}  // namespace counterpoint::scene_joints_test
