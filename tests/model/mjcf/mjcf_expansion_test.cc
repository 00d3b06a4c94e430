// MJCF files: replicas, attached models, and features that flags disable.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/mass_matrix.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_expansion_test {
namespace {

using test::mass_matrix;

constexpr double kRoundOff = 1e-14;  // round-off of a few operations on numbers near one

const Geometry& geometry(const Scene& s, const std::string& name) {
  for (const Geometry& g : s.model.geometries())
    if (g.name == name) return g;
  throw std::out_of_range(name);
}

const JointSpec& joint(const MjcfModel& m, const std::string& name) {
  for (const JointSpec& j : m.robot.joints)
    if (j.name == name) return j;
  throw std::out_of_range(name);
}

bool excluded(const Model& model, const std::string& a, const std::string& b) {
  const auto index = [&](const std::string& name) {
    for (size_t i = 0; i < model.geometries().size(); ++i)
      if (model.geometries()[i].name == name) return static_cast<int>(i);
    throw std::out_of_range(name);
  };
  const std::pair<int, int> pair = std::minmax(index(a), index(b));
  const auto& all = model.excluded_geometry_pairs();
  return std::find(all.begin(), all.end(), pair) != all.end();
}

class Expansion : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& contents,
                              const std::string& name = "p/m/m.xml") const {
    return folder_.write(name, "<mujoco>" + contents + "</mujoco>");
  }
  MjcfModel read(const std::string& contents) const { return load_mjcf(write(contents)); }
  Scene scene(const std::string& contents) const { return load_scene(write(contents)); }
  void expect_refused(const std::string& contents, std::initializer_list<std::string> words) const {
    try {
      scene(contents);
      ADD_FAILURE() << "accepted; expected a refusal that names " << *words.begin();
    } catch (const InputError& error) {
      for (const std::string& word : words)
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
            << error.what() << "\n  lacks: " << word;
    }
  }
  test::TempFolder folder_;
};

TEST_F(Expansion, ReplicasNestAsInMuJoCosExample) {
  // MuJoCo's XML Reference, "replicate": the inner suffix comes first.
  const Scene s = scene(R"(<worldbody><replicate count='2' offset='0 1 0' euler='90 0 0'>
    <replicate count='2' sep='-' offset='1 0 0' euler='0 90 0'><geom name='Alice' type='box' size='.1 .2 .3'/>
    </replicate></replicate></worldbody>)");
  const auto expect = [&](const char* name, const Vector3& p, const Quaternion& q) {
    const Pose& X = geometry(s, name).X_BG;
    EXPECT_LT((X.translation - p).norm(), kRoundOff) << name;
    EXPECT_LT((X.rotation - q.normalized().toRotationMatrix()).norm(), kRoundOff) << name;
  };
  expect("world/Alice-00", {0, 0, 0}, {1, 0, 0, 0});
  expect("world/Alice-10", {1, 0, 0}, {1, 0, 1, 0});
  expect("world/Alice-01", {0, 1, 0}, {1, 1, 0, 0});
  expect("world/Alice-11", {1, 1, 0}, {0.5, 0.5, 0.5, 0.5});
  EXPECT_EQ(s.model.geometries().size(), 4u);
}

TEST_F(Expansion, OffsetsAreInTheFrameOfTheReplicaBefore) {
  // Steps of 1 m with rotations of 90 degrees follow a square.
  const MjcfModel m = read(R"(<compiler angle='radian'/><worldbody>
    <replicate count='10' offset='1 0 0' euler='0 0 1.5707963267948966'>
    <body name='b' pos='0 0 2'><freejoint name='f'/><geom size='0.1'/></body></replicate></worldbody>)");
  ASSERT_EQ(m.coordinates.size(), 10u);
  const double x[] = {0, 1, 1, 0}, y[] = {0, 0, 1, 1};
  for (int i = 0; i < 10; ++i) {
    const std::vector<double>& at = m.coordinates[i].reference;
    EXPECT_EQ(m.coordinates[i].joint,
              "f0" + std::to_string(i));  // two digits, as the number 10 has
    EXPECT_NEAR(at[0], x[i % 4], 10 * kRoundOff);
    EXPECT_NEAR(at[1], y[i % 4], 10 * kRoundOff);
    EXPECT_EQ(at[2], 2.0);
  }
}

TEST_F(Expansion, WhatNamesAReplicaIsReplicated) {
  const Scene s = scene(
      R"(<worldbody><body name='fixed'><joint name='lone' axis='0 1 0'/><geom name='g' size='0.1'/></body>
    <replicate count='2' offset='0 1 0'><body name='arm'><joint name='j' axis='0 1 0'/>
      <geom name='upper' size='0.1' pos='1 0 0'/><body name='hand' pos='1 0 0'><joint name='k' axis='0 1 0'/>
      <geom name='lower' size='0.1' pos='1 0 0'/></body></body></replicate></worldbody>
    <contact><exclude body1='arm' body2='fixed'/><pair geom1='lower' geom2='g' friction='0.3'/></contact>
    <equality><joint joint1='k' joint2='j' polycoef='0 2'/></equality>
    <actuator><position name='servo' joint='j' kp='7'/><motor joint='lone'/></actuator>
    <keyframe><key ctrl='0 0.25 0.5'/></keyframe>)");
  EXPECT_TRUE(excluded(s.model, "arm0/upper0", "fixed/g"));
  EXPECT_TRUE(excluded(s.model, "arm1/upper1", "fixed/g"));
  EXPECT_FALSE(excluded(s.model, "hand0/lower0", "fixed/g"));
  int paired = 0;
  for (const PairMaterial& p : s.model.pair_materials())
    paired += p.material.friction == 0.3 ? 1 : 0;
  EXPECT_EQ(paired, 2);
  ASSERT_EQ(s.model.mimics().size(), 2u);
  // Copies follow the originals, so the motor keeps the first control.
  const auto target = [&](const char* name) {
    return s.model.servos().at(s.model.find_servo(s.model.find_joint(name))).position;
  };
  EXPECT_EQ(target("j0"), 0.25);
  EXPECT_EQ(target("j1"), 0.5);
}

/// An arm of two links; its model sets degrees as its angle unit.
std::string arm(const std::string& prefix, const std::string& at, const std::string& angles) {
  const std::string p = prefix;
  return "<body name='" + p + "base' pos='" + at + "' euler='" + angles + "'><joint name='" + p +
         "j' axis='0 1 0' range='-90 90' damping='0.5'/><geom name='" + p +
         "g' type='capsule' size='0.05 0.2' pos='0 0 0.2'/><body name='" + p +
         "tip' pos='0 0 0.4'><joint name='" + p + "k' axis='1 0 0' damping='2'/><geom name='" + p +
         "h' type='box' size='0.1 0.2 0.1' mass='0.5'/><site name='" + p + "s'/></body></body>";
}

TEST_F(Expansion, AnAttachedModelIsTheOneWrittenOut) {
  folder_.write(
      "p/m/arm.xml",
      "<mujoco model='arm'><compiler angle='degree'/><option timestep='0.1'/>"
      "<default><joint damping='2'/></default><worldbody>" +
          arm("", "0 0 1", "0 0 30") +
          "</worldbody><equality><connect body1='tip' body2='base' anchor='0 0 0' active='false'/>"
          "</equality><actuator><position joint='j' kp='9' ctrlrange='-1 1'/></actuator>"
          "<keyframe><key name='home' qpos='0.3 0.4' ctrl='0.3'/></keyframe></mujoco>");
  const std::string head = "<compiler angle='radian'/><default><joint damping='77'/></default>";
  const Scene attached = scene(head + R"(<asset><model name='a' file='arm.xml'/></asset><worldbody>
    <frame pos='1 0 0'><attach model='a' prefix='l_'/></frame>
    <body name='box'><freejoint/><geom size='0.3'/></body>
    <frame pos='3 0 0'><attach model='a' body='tip' prefix='r_'/></frame></worldbody>)");
  // The same model without attachment, in degrees.
  const Scene written = scene("<worldbody>" + arm("l_", "1 0 1", "0 0 30") +
                              R"(<body name='box'><freejoint/><geom size='0.3'/></body>
    <body name='r_tip' pos='3 0 0.4'><joint name='r_k' axis='1 0 0' damping='2'/>
      <geom name='r_h' type='box' size='0.1 0.2 0.1' mass='0.5'/></body></worldbody>
    <actuator><position joint='l_j' kp='9' ctrlrange='-1 1'/></actuator>)");
  ASSERT_EQ(attached.model.nv(), written.model.nv());
  ASSERT_EQ(attached.model.num_joints(), written.model.num_joints());
  VectorX q = written.q;
  q[0] = 0.3;  // from the attached keyframe; the rest stays in the reference pose
  q[1] = 0.4;
  EXPECT_EQ(attached.q, q);
  EXPECT_LT((mass_matrix(attached.model, q) - mass_matrix(written.model, q)).cwiseAbs().maxCoeff(),
            kRoundOff);
  const auto X = body_poses(attached.model, q), Y = body_poses(written.model, q);
  for (size_t i = 0; i < X.size(); ++i)
    EXPECT_LT((X[i].translation - Y[i].translation).norm(), kRoundOff);
  EXPECT_EQ(attached.model.damping(), written.model.damping());
  for (int j = 0; j < written.model.num_joints(); ++j) {
    EXPECT_EQ(attached.model.joint(j).name, written.model.joint(j).name);
    EXPECT_EQ(attached.model.joint(j).lower, written.model.joint(j).lower);
  }
  EXPECT_EQ(attached.options.time_step, 0.002);  // options of the attached model do not apply
  ASSERT_EQ(attached.model.servos().size(), 1u);
  EXPECT_EQ(attached.model.servos()[0].stiffness, 9.0);
  EXPECT_EQ(attached.model.servos()[0].position, 0.3);
}

TEST_F(Expansion, PartsOfTheSameModelAreAttachedAgain) {
  const MjcfModel m =
      read(R"(<worldbody><body name='leg'><joint name='hip'/><geom size='0.1'/></body>
    <body name='b' pos='0 0 1'><joint name='r'/><geom size='0.1'/><frame pos='1 0 0'><attach body='leg' prefix='two_'/></frame>
    </body></worldbody><actuator><motor joint='hip'/><motor joint='r'/></actuator>)");
  EXPECT_EQ(joint(m, "two_hip").parent, "b");
  EXPECT_EQ(joint(m, "two_hip").X_PJ.translation, Vector3(1, 0, 0));
  ASSERT_EQ(m.actuators.size(), 3u);
  EXPECT_EQ(m.actuators[2].joint, "two_hip");
}

TEST_F(Expansion, CopiesHaveOneMessage) {
  const std::string contents =
      "<worldbody><replicate count='3'><body name='b'><joint name='j'/><geom size='0.1' "
      "unheard='1'/>"
      "</body></replicate></worldbody>";
  try {
    scene(contents);
    ADD_FAILURE();
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("unheard"), std::string::npos);
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

TEST_F(Expansion, WhatCannotBeAttachedIsRefused) {
  folder_.write(
      "p/m/self.xml",
      "<mujoco model='s'><asset><model name='s' file='self.xml'/></asset><worldbody>"
      "<attach model='s' prefix='x'/><attach model='s' prefix='y'/></worldbody></mujoco>");
  const std::string self = "<asset><model name='s' file='self.xml'/></asset>";
  expect_refused(self + "<worldbody><attach model='s' prefix='a'/></worldbody>",
                 {"self.xml", "attached within"});
  expect_refused(self + "<worldbody>\n<attach model='t' prefix='a'/></worldbody>",
                 {"m.xml:2: <attach>", "'t'", "s"});
  expect_refused("<worldbody>\n<attach body='b' prefix='a'/></worldbody>",
                 {"m.xml:2", "no body 'b'"});
  expect_refused("<worldbody><body name='b'>\n<attach body='b' prefix='a'/></body></worldbody>",
                 {"m.xml:2", "itself"});
  expect_refused(
      "<asset><model name='s' file='none.xml'/></asset><worldbody><attach model='s' "
      "prefix='a'/></worldbody>",
      {"model 'none.xml'", "not found"});
  expect_refused("<worldbody>\n<replicate count='0'><geom/></replicate></worldbody>",
                 {"m.xml:2: <replicate>", "count"});
  std::string deep = "<geom size='1'/>";
  for (int i = 0; i < 8; ++i) deep = "<replicate count='1000'>" + deep + "</replicate>";
  expect_refused("<worldbody>" + deep + "</worldbody>", {"make it smaller"});
  expect_refused("<worldbody>\n<include file='none.xml'/></worldbody>",
                 {"m.xml:2: <include>: included file 'none.xml'"});
}

const std::string kHinges = R"(<worldbody><geom name='floor' type='plane' size='1 1 1'/>
  <body name='a' gravcomp='1'><joint name='j' axis='0 1 0' range='-10 10' frictionloss='3' damping='4' stiffness='5'/>
    <geom name='ga' size='0.1' pos='0.3 0 0'/><body name='b' pos='1 0 0'>
    <joint name='k' axis='0 1 0' range='-20 20'/><geom name='gb' size='0.1' pos='0.3 0 0'/></body></body>
  <body name='c' pos='0 3 0'><freejoint/><geom name='gc' size='0.1'/></body></worldbody>
  <contact><pair geom1='ga' geom2='gc'/></contact><equality><connect body1='c' body2='b' anchor='0 0 0'/></equality>
  <actuator><position joint='k' kp='6' ctrlrange='-1 1' group='3'/></actuator><keyframe><key ctrl='2'/></keyframe>)";

TEST_F(Expansion, FlagsAreObeyed) {
  const auto with = [&](const std::string& flag) {
    return read("<option><flag " + flag + "/></option>" + kHinges);
  };
  const MjcfModel on = with("contact='enable'");
  ASSERT_EQ(joint(on, "j").dry_friction, 3.0);
  ASSERT_EQ(on.closures.size(), 1u);
  const auto limited = [](const MjcfModel& m) { return std::isfinite(joint(m, "j").lower); };
  for (const char* flag : {"constraint='disable'", "limit='disable'"})
    EXPECT_FALSE(limited(with(flag))) << flag;
  for (const char* flag : {"constraint='disable'", "frictionloss='disable'"})
    EXPECT_EQ(joint(with(flag), "j").dry_friction, 0.0) << flag;
  for (const char* flag : {"constraint='disable'", "equality='disable'"})
    EXPECT_EQ(with(flag).closures.size(), 0u) << flag;
  EXPECT_EQ(joint(with("spring='disable'"), "j").stiffness, 0.0);
  EXPECT_EQ(joint(with("spring='disable'"), "j").damping, 4.0);
  EXPECT_EQ(joint(with("damper='disable'"), "j").damping, 0.0);
  EXPECT_EQ(with("spring='disable'").robot.links[1].gravity_compensation, 1.0);
  EXPECT_EQ(with("spring='disable' damper='disable'").robot.links[1].gravity_compensation, 0.0);
  EXPECT_EQ(joint(with("actuation='disable'"), "k").servo.stiffness, 0.0);
  EXPECT_FALSE(with("clampctrl='disable'").actuators[0].least.has_value());
  EXPECT_EQ(with("gravity='disable'").gravity, Vector3(0, 0, 0));
  EXPECT_EQ(joint(read("<option actuatorgroupdisable='1 3'/>" + kHinges), "k").servo.stiffness,
            0.0);
  EXPECT_EQ(joint(read("<option actuatorgroupdisable='1 2'/>" + kHinges), "k").servo.stiffness,
            6.0);
  expect_refused("<option>\n<flag filterparent='disable'/></option>" + kHinges,
                 {"m.xml:2: <flag>", "remove"});
  expect_refused("<option unheard='1'/>" + kHinges, {"unheard"});
  for (const char* group : {"1e300", "1.5"})
    expect_refused("<option\nactuatorgroupdisable='" + std::string(group) + "'/>" + kHinges,
                   {"actuatorgroupdisable: a whole number"});
}

TEST_F(Expansion, ContactsAreThoseThatTheOptionsLeave) {
  struct Case {
    const char* option;
    bool pair, floor;  // expected collisions: of ga and gc (an explicit pair), of gc and the floor
  };
  for (const Case& c : {Case{"", true, true}, Case{"<option collision='predefined'/>", true, false},
                        Case{"<option><flag contact='disable'/></option>", false, false},
                        Case{"<option><flag constraint='disable'/></option>", false, false}}) {
    const Model model = scene(c.option + kHinges).model;
    EXPECT_EQ(!excluded(model, "a/ga", "c/gc"), c.pair) << c.option;
    EXPECT_EQ(!excluded(model, "c/gc", "world/floor"), c.floor) << c.option;
  }
  // Geometry without contype collides in explicit pairs only; "dynamic" ignores pairs.
  const std::string bare =
      R"(<worldbody><geom name='floor' type='plane' size='1 1 1'/><body name='c'><freejoint/>
    <geom name='gc' size='0.1' contype='0' conaffinity='0'/></body></worldbody>
    <contact><pair geom1='gc' geom2='floor'/></contact>)";
  EXPECT_EQ(scene(bare).model.geometries().size(), 2u);
  EXPECT_EQ(scene("<option collision='dynamic'/>" + bare).model.geometries().size(), 1u);
}

TEST_F(Expansion, FrictionOfAPairThatDiffersWithTheDirection) {
  const std::string contents =
      R"(<worldbody><geom name='floor' type='box' size='1 1 1'/><body name='c' pos='0 0 2'><freejoint/>
    <geom name='gc' size='0.1'/></body></worldbody><contact><pair geom1='gc' geom2='floor' friction='0.9 0.4'/></contact>)";
  expect_refused(contents, {"leave_out: [friction_directions]"});
  write(contents);
  const Scene s = load_scene(
      folder_.write("p/m/s.yaml", "models: [{mjcf: m.xml, leave_out: [friction_directions]}]"));
  ASSERT_EQ(s.model.pair_materials().size(), 1u);
  EXPECT_EQ(s.model.pair_materials()[0].material.friction, 0.4);
}

// MuJoCo's first tangent at a plane is the world's y axis, or z at a wall that faces along y.
TEST_F(Expansion, FrictionOfAPairWithAPlaneHasTheDirectionsOfMuJoCo) {
  const auto axis_in_world = [&](const std::string& plane) {
    const Scene s = scene("<worldbody><geom name='floor' type='plane' size='1 1 1' " + plane +
                          R"(/><body name='c' pos='0 2 2'><freejoint/>
    <geom name='gc' size='0.1'/></body></worldbody><contact><pair geom1='gc' geom2='floor' friction='0.9 0.4'/></contact>)");
    const PairMaterial& pair = s.model.pair_materials().at(0);
    EXPECT_EQ(pair.material.friction, 0.9);
    EXPECT_EQ(pair.material.friction_across, 0.4);
    const int owner = pair.material.axis_of_second ? pair.geometry_b : pair.geometry_a;
    const Geometry& g = s.model.geometries()[owner];
    EXPECT_EQ(g.shape.type, ShapeType::kPlane);
    return Vector3(g.X_BG.rotation * pair.material.friction_axis);
  };
  constexpr double kRounding = 1e-15;  // two rotations
  EXPECT_LT((axis_in_world("euler='0 0 30'") - Vector3::UnitY()).norm(), kRounding);
  EXPECT_LT((axis_in_world("zaxis='0 -1 0'") - Vector3::UnitZ()).norm(), kRounding);
}

}  // namespace
}  // namespace counterpoint::mjcf_expansion_test
