// MJCF files: actuators, couplings, closures and contacts, and rejected features.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/shapes/find_geometry.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_forces_test {
namespace {

constexpr double kRoundOff = 1e-14;

class MjcfForcesTest : public testing::Test {
 protected:
  Scene scene(const std::string& contents) {
    return load_scene(folder_.write("m.xml", "<mujoco>" + contents + "</mujoco>"));
  }
  void expect_refused(const std::string& contents, std::initializer_list<std::string> words) {
    try {
      // A file may access its parent folder, which must not be the folder shared by all tests.
      load_scene(folder_.write("package/models/m.xml", "<mujoco>" + contents + "</mujoco>"));
      ADD_FAILURE() << "accepted; expected a refusal that names " << *words.begin();
    } catch (const InputError& error) {
      for (const std::string& word : words)
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
            << error.what() << "\n  does not name: " << word;
    }
  }
  static const JointServo& servo(const Scene& s, const char* joint) {
    return s.model.servos().at(s.model.find_servo(s.model.find_joint(joint)));
  }
  /// Two hinges, l1 and l2, side by side, with equal balls of 1 kg at a distance of 1 m.
  const std::string two_ = R"(<worldbody>
    <body name='l1'><joint name='j1' axis='0 1 0'/><geom name='g1' size='0.1' pos='1 0 0' mass='1'/></body>
    <body name='l2' pos='0 3 0'><joint name='j2' axis='0 1 0'/><geom name='g2' size='0.1' pos='1 0 0' mass='1'/></body>
    </worldbody>)";
  test::TempFolder folder_;
};

TEST_F(MjcfForcesTest, ServosFollowControlsAndGears) {
  // The actuator force kp (u - g q) - kv g w acts on the length g q, hence g times it on the joint.
  const Scene s = scene(two_ + R"(<actuator>
    <position joint='j1' kp='10' kv='3' gear='2' ctrlrange='-1 1' forcerange='-5 5'/>
    <velocity joint='j2' kv='4'/></actuator><keyframe><key qpos='0 0' ctrl='9 0.5'/></keyframe>)");
  EXPECT_NEAR(servo(s, "j1").stiffness, 40, kRoundOff);
  EXPECT_NEAR(servo(s, "j1").damping, 12, kRoundOff);
  EXPECT_NEAR(servo(s, "j1").position, 0.5, kRoundOff);  // u is limited to 1
  EXPECT_EQ(s.model.joint(s.model.find_joint("j1")).effort_limit, 10.0);
  EXPECT_NEAR(servo(s, "j2").damping, 4, kRoundOff);
  EXPECT_NEAR(servo(s, "j2").velocity, 0.5, kRoundOff);
}

TEST_F(MjcfForcesTest, GeneralActuatorsArePositionServosByOtherNames) {
  const Scene s = scene(two_ + R"(<default><general biastype='affine'/></default><actuator>
    <general joint='j1' gainprm='2' biasprm='1 -4 -0.5'/></actuator><keyframe><key ctrl='3'/></keyframe>)");
  EXPECT_NEAR(servo(s, "j1").stiffness, 4, kRoundOff);
  EXPECT_NEAR(servo(s, "j1").damping, 0.5, kRoundOff);
  EXPECT_NEAR(servo(s, "j1").position, (2 * 3 + 1) / 4.0, kRoundOff);
}

TEST_F(MjcfForcesTest, DampingRatioOneIsCritical) {
  const Scene s = scene(two_ + "<actuator><position joint='j1' kp='25' dampratio='1'/></actuator>");
  const double inertia = 1.0 + 0.4 * 0.01;
  EXPECT_NEAR(servo(s, "j1").damping, 2 * std::sqrt(25 * inertia), 1e-13);
}

TEST_F(MjcfForcesTest, DampingRatiosTakeTheInertiaOfTheDrivenJoint) {
  // j2 is driven and follows j1, whose servo it becomes: 3 q2 = -6 q1.
  std::string bodies = two_;
  bodies.replace(bodies.rfind("mass='1'"), 8, "mass='3'");
  const Scene s = scene(bodies + R"(<equality>
    <joint joint1='j2' joint2='j1' polycoef='0 -2 0 0 0'/></equality>
    <actuator><position joint='j2' kp='25' dampratio='1' gear='3'/></actuator>)");
  const double inertia = 3.0 * (1.0 + 0.4 * 0.01);
  EXPECT_NEAR(servo(s, "j1").damping, 2 * std::sqrt(25 * inertia / 9) * 36, 1e-12);
}

TEST_F(MjcfForcesTest, EqualityOfJointsIsAMimic) {
  const Scene s = scene(
      two_ + R"(<equality><joint joint1='j2' joint2='j1' polycoef='0.1 -2 0 0 0'/></equality>)");
  ASSERT_EQ(s.model.mimics().size(), 1u);
  const Mimic& mimic = s.model.mimics()[0];
  EXPECT_EQ(s.model.joint(mimic.joint).name, "j2");
  EXPECT_EQ(mimic.multiplier, -2.0);
  EXPECT_EQ(mimic.offset, 0.1);
}

TEST_F(MjcfForcesTest, TendonsOfCoupledJointsPullAtTheOneThatLeads) {
  // Length (q1 + q2) / 2 with q2 = q1: equivalent to a servo at j1.
  const Scene s =
      scene(two_ + R"(<tendon><fixed name='t' range='-0.5 0.25' stiffness='6' springlength='0.1'>
      <joint joint='j1' coef='0.5'/><joint joint='j2' coef='0.5'/></fixed></tendon>
    <equality><joint joint1='j2' joint2='j1'/></equality>
    <actuator><position tendon='t' kp='10'/></actuator>)");
  EXPECT_NEAR(servo(s, "j1").stiffness, 10, kRoundOff);
  ASSERT_EQ(s.model.springs().size(), 1u);
  EXPECT_NEAR(s.model.springs()[0].stiffness, 6, kRoundOff);
  EXPECT_NEAR(s.model.springs()[0].reference, 0.1, kRoundOff);
  EXPECT_NEAR(s.model.joint(s.model.find_joint("j1")).lower, -0.5, kRoundOff);
  EXPECT_NEAR(s.model.joint(s.model.find_joint("j1")).upper, 0.25, kRoundOff);
}

TEST_F(MjcfForcesTest, ClosuresAreOfTheReferencePoseAndNotOfTheStart) {
  const Scene s = scene(two_ + R"(<equality><connect body1='l1' body2='l2' anchor='1 0 0'/>
    <weld body1='l1' body2='l2' relpose='0 3 0 1 0 0 0'/></equality><keyframe><key qpos='0.3 0'/></keyframe>)");
  ASSERT_EQ(s.model.closures().size(), 2u);
  const VectorX reference = VectorX::Zero(2);
  const auto X = body_poses(s.model, reference);
  for (const Closure& closure : s.model.closures())
    EXPECT_LT(closure_gap(closure, X).largest(), kRoundOff) << closure.name;
}

TEST_F(MjcfForcesTest, GeomsTouchAsTheirMasksSay) {
  const Scene s = scene(R"(<worldbody><geom name='floor' type='plane' size='1 1 1'/>
    <body name='a' pos='0 0 1'><freejoint/><geom name='g' size='0.1'/>
      <body name='c' pos='0 0 1'><joint/><geom name='g2' size='0.1'/>
        <body name='d' pos='0 0 1'><joint/><geom name='g3' size='0.1' contype='2' conaffinity='2'/></body></body></body>
    <body name='b' pos='1 0 1'><freejoint/><geom name='h' size='0.1' contype='0' conaffinity='1'/></body>
    <body name='v' pos='2 0 1'><freejoint/><geom name='visual' size='0.1' contype='0' conaffinity='0'/></body>
    </worldbody>
    <contact><exclude body1='c' body2='b'/><pair geom1='g3' geom2='g' condim='1'/></contact>)");
  const auto touch = [&](const char* a, const char* b) {
    const auto& excluded = s.model.excluded_geometry_pairs();
    const std::pair<int, int> pair =
        std::minmax(test::find_geometry(s.model, a), test::find_geometry(s.model, b));
    return std::find(excluded.begin(), excluded.end(), pair) == excluded.end();
  };
  EXPECT_EQ(test::find_geometry(s.model, "v/visual"), -1);
  EXPECT_TRUE(touch("world/floor", "a/g"));
  EXPECT_TRUE(touch("a/g", "b/h"));
  EXPECT_FALSE(touch("a/g", "c/g2"));          // connected by a joint
  EXPECT_FALSE(touch("c/g2", "b/h"));          // excluded
  EXPECT_FALSE(touch("world/floor", "d/g3"));  // masks differ
  EXPECT_TRUE(touch("a/g", "d/g3"));           // explicit pair
  EXPECT_EQ(
      s.model
          .pair_material(test::find_geometry(s.model, "a/g"), test::find_geometry(s.model, "d/g3"))
          .friction,
      0.0);
}

TEST_F(MjcfForcesTest, FrictionOfAPairIsTheLargerOrOfTheOneThatGoesFirst) {
  const Scene s = scene(R"(<worldbody><geom name='floor' type='plane' size='1 1 1' friction='0.5'/>
    <body name='a' pos='0 0 1'><freejoint/><geom name='g' size='0.1' friction='0.9 0.01' condim='4'/></body>
    <body name='b' pos='1 0 1'><freejoint/><geom name='h' size='0.1' friction='0.2' priority='1'/></body>
    </worldbody>)");
  const auto pair = [&](const char* a, const char* b) {
    return s.model.pair_material(test::find_geometry(s.model, a), test::find_geometry(s.model, b));
  };
  EXPECT_EQ(pair("world/floor", "a/g").friction, 0.9);
  EXPECT_EQ(pair("world/floor", "a/g").torsional_friction, 0.01);
  EXPECT_EQ(pair("b/h", "a/g").friction, 0.2);
}

TEST_F(MjcfForcesTest, EllipsoidsTouchWithinTheErrorThatIsNoted) {
  const Scene s = scene(
      "<worldbody><body><freejoint/><geom name='e' type='ellipsoid' size='0.3 0.2 "
      "0.1'/></body></worldbody>");
  const Shape& shape = s.model.geometries()[0].shape;
  ASSERT_EQ(shape.type, ShapeType::kConvexMesh);
  for (const Vector3& v : shape.mesh->vertices)
    EXPECT_NEAR(v.cwiseQuotient(Vector3(0.3, 0.2, 0.1)).norm(), 1.0, 0.01);
  EXPECT_TRUE(shape.mesh->source.empty());  // no file that a replay would look for
  bool noted = false;
  for (const Note& note : s.model.notes())
    noted = noted || note.message.find("ellipsoid") != std::string::npos;
  EXPECT_TRUE(noted);
}

TEST_F(MjcfForcesTest, GravcompIsAShareOfTheLinksWeight) {
  const Scene s = scene(R"(<worldbody><body name='fixed' gravcomp='1'><geom size='1'/></body>
    <body name='a' gravcomp='0.25'><joint/><geom size='0.1' pos='0.3 0 0' mass='2'/>
      <body name='welded' pos='0 0 1' gravcomp='-1'><geom size='0.1' mass='3'/></body>
      <body name='b' pos='1 0 0'><joint/><geom size='0.1' mass='5'/></body></body></worldbody>)");
  EXPECT_NE(s.model.gravity().norm(), 0.0);
  const auto& all = s.model.gravity_compensations();
  ASSERT_EQ(all.size(), 2u);  // the fixed link has none, b has none
  for (const GravityCompensation& carried : all) EXPECT_EQ(carried.body, 1);
  EXPECT_NEAR(all[0].mass, 0.5, kRoundOff);
  EXPECT_NEAR(all[1].mass, -3.0, kRoundOff);
  const auto X = body_poses(s.model, s.q);
  EXPECT_LT((X[1] * all[0].center - Vector3(0.3, 0, 0)).norm(), kRoundOff);
  EXPECT_LT((X[1] * all[1].center - Vector3(0, 0, 1)).norm(), kRoundOff);
}

TEST_F(MjcfForcesTest, WhatIsMissingIsRefusedByElementAndLine) {
  const std::string body =
      "\n<worldbody><body name='b'><joint name='j' %/><geom name='g' size='1' "
      "%g/></body></worldbody>";
  const auto with = [&](std::string joint, std::string geom = "") {
    std::string text = body;
    text.replace(text.find("%g"), 2, geom);
    text.replace(text.find('%'), 1, joint);
    return text;
  };
  expect_refused(with("type='ball' stiffness='1'"),
                 {"m.xml:2: <joint> 'j'", "stiffness", "joint_forces"});
  expect_refused(with("", "type='sdf'"), {"m.xml:2: <geom> 'g'", "shape that is not supported"});
  expect_refused(with("wobble='1'"), {"m.xml:2: <joint> 'j'", "wobble"});
  expect_refused(with("axis='0 0 0'"), {"m.xml:2: <joint> 'j'", "axis"});
  expect_refused(with("range='1 x'"), {"m.xml:2: <joint> 'j'", "range: 2 finite numbers"});
  expect_refused(with("", "class='none'"), {"m.xml:2: <geom> 'g'", "no default class 'none'"});
  expect_refused(with("") + "\n<option density='1.2' wind='1 0 0'/>",
                 {"m.xml:3: <option>", "wind", "leave_out: [fluid]"});
  expect_refused(with("", "fluidshape='ellipsoid'") + "\n<option density='1.2'/>",
                 {"m.xml:2: <geom> 'g'", "fluidshape", "leave_out: [fluid]"});
  expect_refused(
      with("") + "\n<actuator><general joint='j' dyntype='user' biastype='affine'/></actuator>",
      {"m.xml:3", "dyntype"});
  expect_refused(with("") + "\n<actuator><motor joint='k'/></actuator>",
                 {"m.xml:3: <motor>", "no joint 'k'"});
  expect_refused(with("") + "\n<tendon><spatial name='t' stiffness='1'/></tendon>",
                 {"m.xml:3: <spatial> 't'", "two sites"});
  expect_refused(with("") + "\n<equality><joint joint1='j' polycoef='1 0 3 0 0'/></equality>",
                 {"m.xml:3", "linearly"});
  expect_refused(with("") + "\n<keyframe><key qpos='1 2'/></keyframe>",
                 {"m.xml:3: <key>", "qpos: 2 numbers; the model has 1"});
  expect_refused("\n<worldbody><flexcomp name='f'/></worldbody>", {"m.xml:2: <flexcomp>"});
  expect_refused("<compiler coordinate='global'/>", {"coordinate"});
}

TEST_F(MjcfForcesTest, AirResistsAsMujocosBoxInTheMeanOverDirections) {
  // A cube of side 0.3 m: all faces have the coefficient c = rho/2 b^2. The nearest isotropic fit
  // of the force c |v_i| v_i per axis is 3 c / 4; likewise for rotation with rho/64 2 b^5.
  constexpr double b = 0.3, rho = 1.2, mu = 0.01;
  const Scene s = scene(R"(<option density='1.2' viscosity='0.01'/>
    <worldbody><body><freejoint/><geom type='box' size='0.15 0.15 0.15' mass='2'/></body></worldbody>)");
  ASSERT_EQ(s.model.drags().size(), 1u);
  const Drag& drag = s.model.drags()[0].drag;
  EXPECT_NEAR(drag.linear, 3 * M_PI * b * mu, kRoundOff);
  EXPECT_NEAR(drag.angular, M_PI * b * b * b * mu, kRoundOff);
  EXPECT_NEAR(drag.quadratic, 0.75 * rho / 2 * b * b, kRoundOff);
  EXPECT_NEAR(drag.angular_quadratic, 0.75 * rho / 32 * std::pow(b, 5), kRoundOff);
}

TEST_F(MjcfForcesTest, WhatIsLeftOutIsNoted) {
  folder_.write("m.xml", "<mujoco><option density='1.2'/>" + two_ + "</mujoco>");
  const Scene s =
      load_scene(folder_.write("s.yaml", "models: [{mjcf: m.xml, leave_out: [fluid]}]"));
  bool noted = false;
  for (const Note& note : s.model.notes())
    noted = noted || note.message.find("left out") != std::string::npos;
  EXPECT_TRUE(noted);
}

TEST_F(MjcfForcesTest, NothingOutsideTheFoldersIsOpened) {
  const test::TempFolder elsewhere;
  const auto secret = elsewhere.write(
      "x/secret.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto inner = elsewhere.write("x/inner.xml", "<mujocoinclude/>");
  expect_refused("<asset><mesh name='m' file='" + secret.string() +
                     "'/></asset><worldbody><body><joint/>"
                     "<geom type='mesh' mesh='m'/></body></worldbody>",
                 {"outside"});
  expect_refused("<include file='" + inner.string() + "'/>", {"outside"});
  folder_.write("package/models/loop.xml",
                "<mujocoinclude><include file='loop.xml'/></mujocoinclude>");
  expect_refused("<include file='loop.xml'/>", {"a second time"});
}

TEST_F(MjcfForcesTest, AnXmlFileMayBeAUrdf) {
  const Scene s = load_scene(folder_.write("r.xml", "<robot name='r'><link name='l'/></robot>"));
  EXPECT_EQ(s.name, "r");
}

}  // namespace
}  // namespace counterpoint::mjcf_forces_test
