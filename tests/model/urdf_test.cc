#include <console_bridge/console.h>
#include <gtest/gtest.h>

#include <numbers>

#include "counterpoint/model/robot_files.h"
#include "support/temp_folder.h"

namespace counterpoint::urdf_test {
namespace {

constexpr double kRoundoff = 1e-13;
const char* const kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string robot(const std::string& content) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"r\">\n" + content + "\n</robot>\n";
}
const std::string kInertial =
    "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
    "</inertial>";
std::string link(const std::string& name, const std::string& content = "") {
  return "<link name='" + name + "'>" + kInertial + content + "</link>\n";
}
std::string collision(const std::string& geometry, const std::string& more = "") {
  return "<collision><geometry>" + geometry + "</geometry>" + more + "</collision>";
}
std::string joint(const std::string& type, const std::string& content = "") {
  return "<joint name='j' type='" + type + "'><parent link='a'/><child link='b'/>" + content +
         "</joint>\n";
}
std::string pair_with(const std::string& type, const std::string& content = "") {
  return robot(link("a") + link("b") + joint(type, content));
}

class UrdfTest : public testing::Test {
 protected:
  RobotSpec load(const std::string& xml, const UrdfOptions& options = {}) const {
    return load_urdf(folder_.write("robots/r.urdf", xml), options);
  }
  void expect_refused(const std::string& xml, int line, const std::vector<std::string>& parts,
                      const UrdfOptions& options = {}) const {
    SCOPED_TRACE(xml);
    try {
      load(xml, options);
      ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("r.urdf:" + std::to_string(line) + ":"), std::string::npos) << message;
      for (const std::string& part : parts) {
        EXPECT_NE(message.find(part), std::string::npos) << part << " is missing in: " << message;
      }
    }
  }
  static bool noted(const RobotSpec& spec, const std::string& text) {
    for (const Note& note : spec.notes) {
      if ((note.where + ": " + note.message).find(text) != std::string::npos) return true;
    }
    return false;
  }
  test::TempFolder folder_;
};

TEST_F(UrdfTest, ReadsLinksAndJoints) {
  const RobotSpec spec = load(robot(R"(<link name="z_first"><inertial>
<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><mass value="2"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="2.5"/></inertial></link>
<link name="a_second"/>
<joint name="j" type="revolute"><parent link="z_first"/><child link="a_second"/>
<origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><axis xyz="0 2 0"/>
<limit lower="-1" upper="2" effort="10" velocity="3"/><dynamics damping="0.5" friction="0.25"/></joint>)"));
  ASSERT_EQ(spec.links.size(), 2u);
  EXPECT_EQ(spec.links[0].name, "z_first") << "file order";
  EXPECT_NE(spec.links[0].where.find("r.urdf:3"), std::string::npos);
  EXPECT_EQ(spec.links[0].inertia.mass, 2.0);
  EXPECT_EQ(spec.links[0].inertia.center, Vector3(1, 2, 3));
  Matrix3 turned = Matrix3::Zero();
  turned.diagonal() << 2, 1, 2.5;
  EXPECT_LT((spec.links[0].inertia.rotational - turned).norm(), kRoundoff);
  const JointSpec& j = spec.joints.at(0);
  EXPECT_LT((j.X_PJ.rotation - rotation_from_rpy(0.4, 0.5, 0.6)).norm(), kRoundoff);
  EXPECT_EQ(j.X_PJ.translation, Vector3(0.1, 0.2, 0.3));
  EXPECT_EQ(j.axis.normalized(), Vector3::UnitY());
  EXPECT_EQ(j.lower, -1.0);
  EXPECT_EQ(j.upper, 2.0);
  EXPECT_EQ(j.effort_limit, 10.0);
  EXPECT_EQ(j.velocity_limit, 3.0);
  EXPECT_EQ(j.damping, 0.5);
  EXPECT_EQ(j.dry_friction, 0.25);
}

// urdfdom decodes such a name differently from tinyxml2 and then does not find its link.
TEST_F(UrdfTest, RefusesNamesThatAreNotText) {
  expect_refused(robot(link("<\xbf\xc3\xc3\xc3<<body")), 3, {"link", "not valid text", "UTF-8"});
}

TEST_F(UrdfTest, JointTypes) {
  EXPECT_EQ(load(pair_with("continuous")).joints[0].type, JointType::kRevolute);
  EXPECT_EQ(load(pair_with("continuous")).joints[0].upper, std::numeric_limits<double>::infinity());
  EXPECT_EQ(
      load(pair_with("prismatic", "<limit upper='1' effort='1' velocity='1'/>")).joints[0].type,
      JointType::kPrismatic);
  EXPECT_EQ(load(pair_with("planar")).joints[0].type, JointType::kPlanar);
  EXPECT_EQ(load(pair_with("floating")).joints[0].type, JointType::kFloating);
  EXPECT_EQ(load(pair_with("spherical")).joints[0].type, JointType::kSpherical);
  EXPECT_TRUE(load(pair_with("fixed")).joints[0].fixed);
  expect_refused(pair_with("hinge"), 5, {"hinge"});
  expect_refused(pair_with("revolute"), 5, {"j", "limit", "continuous"});
}

TEST_F(UrdfTest, Shapes) {
  const RobotSpec spec =
      load(robot(link("a", collision("<box size='2 4 6'/>") + collision("<sphere radius='0.5'/>") +
                               collision("<cylinder radius='0.5' length='3'/>") +
                               collision("<capsule radius='0.25' length='2'/>"))));
  const auto& c = spec.links[0].collisions;
  ASSERT_EQ(c.size(), 4u);
  EXPECT_EQ(c[0].shape.type, ShapeType::kBox);
  EXPECT_EQ(c[0].shape.size, Vector3(1, 2, 3));
  EXPECT_EQ(c[1].shape.type, ShapeType::kSphere);
  EXPECT_EQ(c[1].shape.size[0], 0.5);
  EXPECT_EQ(c[2].shape.type, ShapeType::kCylinder);
  EXPECT_EQ(c[2].shape.size, Vector3(0.5, 1.5, 0));
  EXPECT_EQ(c[3].shape.type, ShapeType::kCapsule);
  EXPECT_EQ(c[3].shape.size, Vector3(0.25, 1, 0));
  expect_refused(robot(link("a", collision("<cone radius='1'/>"))), 3, {"cone"});
}

TEST_F(UrdfTest, Surfaces) {
  const std::string ball = "<sphere radius='0.5'/>";
  const RobotSpec spec = load(
      robot(link("bullet",
                 "<contact><lateral_friction value='0.3'/><restitution value='0.1'/>"
                 "<rolling_friction value='0.01'/><spinning_friction value='0.02'/>"
                 "<stiffness value='100'/></contact>" +
                     collision(ball)) +
            link("drake", collision(ball,
                                    "<drake:proximity_properties><drake:mu_static value='0.9'/>"
                                    "<drake:mu_dynamic value='0.6'/>"
                                    "</drake:proximity_properties>")) +
            link("gazebo", collision(ball)) + link("none", collision(ball)) +
            "<gazebo reference='gazebo'><mu1>0.7</mu1><mu2>0.2</mu2><fdir1>0 1 0</fdir1></gazebo>"
            "<gazebo reference='none'><mu1>0.7</mu1><mu2>0.2</mu2></gazebo>"
            "<joint name='1' type='fixed'><parent link='bullet'/><child link='drake'/></joint>"
            "<joint name='2' type='fixed'><parent link='bullet'/><child link='gazebo'/></joint>"
            "<joint name='3' type='fixed'><parent link='bullet'/><child link='none'/></joint>"));
  const auto material = [&](size_t i) { return spec.links[i].collisions[0].material; };
  EXPECT_EQ(material(0).friction, 0.3);
  EXPECT_EQ(material(0).restitution, 0.1);
  EXPECT_EQ(material(0).rolling_friction, 0.01);
  EXPECT_EQ(material(0).torsional_friction, 0.02);
  EXPECT_EQ(material(1).friction, 0.6);
  EXPECT_EQ(material(2).friction, 0.7);
  EXPECT_EQ(material(2).friction_across, 0.2);
  EXPECT_EQ(material(2).friction_axis, Vector3(0, 1, 0));
  EXPECT_EQ(material(3).friction, 0.7);
  EXPECT_FALSE(material(3).is_directional());
  EXPECT_TRUE(noted(spec, "mu1 = 0.7 and mu2 = 0.2 without <fdir1>"));
  EXPECT_TRUE(noted(spec, "link 'bullet': <contact>: not used: <stiffness>"));
}

TEST_F(UrdfTest, StiffnessOfGazeboIsThatOfASpringUpToAHardOne) {
  const std::string ball = "<sphere radius='0.5'/>";
  const RobotSpec spec =
      load(robot(link("soft", collision(ball)) + link("hard", collision(ball)) +
                 "<gazebo reference='soft'><kp>20000</kp><kd>30</kd></gazebo>"
                 "<gazebo reference='soft'><mu1>0.7</mu1></gazebo>"
                 "<gazebo reference='hard'><kp>1e12</kp><kd>1</kd></gazebo>"
                 "<joint name='1' type='fixed'><parent link='soft'/><child link='hard'/></joint>"));
  const auto material = [&](size_t i) { return spec.links[i].collisions[0].material; };
  EXPECT_EQ(material(0).stiffness, 20000.0);
  EXPECT_EQ(material(0).damping, 30.0);
  EXPECT_EQ(material(0).friction, 0.7);
  EXPECT_FALSE(material(1).is_soft());
  EXPECT_EQ(material(1).damping, 0.0);
}

TEST_F(UrdfTest, NotesWhatItDoesNotUse) {
  const RobotSpec spec = load(robot(
      link("a", "<visual><geometry><mesh filename='none.stl'/></geometry></visual>") + link("b") +
      joint("continuous", "<dynamics damping='1' friction='2' spring_stiffness='3'/><loop/>") +
      "<loop_joint name='closing'/><drake:ball_constraint/>"
      "<transmission name='t'><joint name='j'/><actuator name='m'>"
      "<drake:rotor_inertia value='0.001'/><drake:gear_ratio value='20'/></actuator></transmission>"
      "<material name='red'/>"));
  EXPECT_TRUE(noted(spec, "spring_stiffness=\"3\""));
  EXPECT_TRUE(noted(spec, "joint 'j': <loop> is not used"));
  EXPECT_TRUE(noted(spec, "<loop_joint> 'closing' is not used"));
  EXPECT_TRUE(noted(spec, "<drake:ball_constraint> is not used"));
  EXPECT_EQ(spec.notes.size(), 4u);
  EXPECT_NEAR(spec.joints[0].armature, 0.4, kRoundoff);
}

TEST_F(UrdfTest, LenienciesAreNoted) {
  const RobotSpec spec = load(robot("<link name='a'><inertial><mass value='1'/></inertial>" +
                                    kInertial + "</link>" + link("b") +
                                    "<joint name='w' type='fixed'><parent link='world'/>"
                                    "<child link='a'/></joint>" +
                                    joint("revolute", "<limit effort='3'/>")));
  EXPECT_TRUE(noted(spec, "point mass"));
  EXPECT_TRUE(noted(spec, "more than one <inertial>"));
  EXPECT_TRUE(noted(spec, "no link 'world'"));
  EXPECT_TRUE(noted(spec, "taken as unlimited"));
  EXPECT_EQ(spec.links[0].inertia.mass, 2.0);
  EXPECT_EQ(spec.joints[1].upper, std::numeric_limits<double>::infinity());
  EXPECT_EQ(spec.joints[1].effort_limit, 3.0);
  EXPECT_EQ(spec.joints[1].velocity_limit, std::numeric_limits<double>::infinity());
}

TEST_F(UrdfTest, RepairsInertiasWhenAsked) {
  const std::string bad = robot(
      "<link name='a'><inertial><mass value='1'/>"
      "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='5'/></inertial></link>");
  EXPECT_EQ(load(bad).links[0].inertia.rotational(2, 2), 5.0);
  UrdfOptions options;
  options.repair_inertias = true;
  const RobotSpec repaired = load(bad, options);
  // The excess of 3 is distributed: 1 + 1, 1 + 1, 5 - 1.
  EXPECT_LT((repaired.links[0].inertia.rotational.diagonal() - Vector3(2, 2, 4)).norm(), kRoundoff);
  EXPECT_TRUE(noted(repaired, "replaced"));
}

TEST_F(UrdfTest, FindsMeshes) {
  folder_.write("pkg/meshes/t.obj", kTetrahedron);
  folder_.write("robots/local/t.obj", kTetrahedron);
  const auto with_mesh = [&](const std::string& name, const std::string& scale = "1 1 1") {
    return robot(link("a", collision("<mesh filename='" + name + "' scale='" + scale + "'/>")));
  };
  const auto mesh_of = [](const RobotSpec& spec) { return spec.links[0].collisions[0].shape.mesh; };
  for (const std::string& name :
       {std::string("package://pkg/meshes/t.obj"), std::string("model://pkg/meshes/t.obj"),
        std::string("local/t.obj"), std::string("../pkg/meshes/t.obj"),
        "file://" + (folder_.path() / "pkg/meshes/t.obj").string(),
        (folder_.path() / "pkg/meshes/t.obj").string()}) {
    const RobotSpec spec = load(with_mesh(name));
    ASSERT_NE(mesh_of(spec), nullptr) << name;
    EXPECT_NEAR(mesh_of(spec)->volume, 1.0, 1e-6) << name;
    EXPECT_TRUE(spec.notes.empty()) << name;
  }
  EXPECT_NEAR(mesh_of(load(with_mesh("local/t.obj", "2 2 -2")))->volume, 8.0, 1e-5);
  // The package is unknown, but the end of the path fits a file: it is used, with a note.
  const RobotSpec guessed = load(with_mesh("package://elsewhere/pkg/meshes/t.obj"));
  EXPECT_TRUE(noted(guessed, "is taken to be"));
  UrdfOptions options;
  options.packages["other"] = folder_.path() / "pkg";
  EXPECT_NE(mesh_of(load(with_mesh("package://other/meshes/t.obj"), options)), nullptr);
  expect_refused(with_mesh("package://other/meshes/u.obj"), 3, {"link 'a'", "u.obj"}, options);
  expect_refused(with_mesh("package://nowhere/u.obj"), 3, {"nowhere", "packages"});
  expect_refused(with_mesh("u.obj"), 3, {"u.obj", "robots"});
  expect_refused(with_mesh("/none/u.obj"), 3, {"/none/u.obj"});
}

TEST_F(UrdfTest, SharesHullsAndNotesConcavity) {
  // An L-shaped prism of volume 3; its hull adds half of the missing corner.
  const std::string l_prism =
      "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
      "v 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1\n"
      "f 4 3 2 1\nf 6 5 4 1\nf 7 8 9 10\nf 7 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\n"
      "f 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
  folder_.write("robots/l.obj", l_prism);
  const std::string one = collision("<mesh filename='l.obj'/>");
  const RobotSpec spec = load(robot(link("a", one + one)));
  const auto& c = spec.links[0].collisions;
  EXPECT_EQ(c[0].shape.mesh, c[1].shape.mesh);
  EXPECT_NEAR(c[0].shape.mesh->source_volume, 3.0, 1e-6);
  EXPECT_NEAR(c[0].shape.mesh->volume, 3.5, 1e-6);
  EXPECT_EQ(c[0].shape.mesh->pieces.size(), 2u);
  EXPECT_TRUE(noted(spec, "2 convex pieces"));
}

TEST_F(UrdfTest, TakesOptenvAtItsDefaultAndSaysSo) {
  const RobotSpec spec =
      load(pair_with("continuous", "<origin xyz='$(optenv NOT_ASKED 1 2 3)' rpy='0 0 0'/>"));
  EXPECT_EQ(spec.joints[0].X_PJ.translation, Vector3(1, 2, 3));
  EXPECT_TRUE(noted(spec, "NOT_ASKED"));
}

TEST_F(UrdfTest, RefusesBrokenFiles) {
  expect_refused("", 1, {});
  expect_refused("\n<?xml version=\"1.0\"?><robot name='r'><link name='a'/></robot>", 1,
                 {"not well-formed XML"});
  expect_refused("<robot name='r'>\n<link name='a'>\n</robot>", 2, {"not well-formed XML"});
  expect_refused("<sdf/>", 1, {"<sdf>", "<robot>"});
  expect_refused(robot("<link/>"), 3, {"name"});
  expect_refused(robot(link("a") + link("a")), 4, {"'a'", "twice"});
  expect_refused(robot(""), 1, {});
  expect_refused(robot(link("a") + "<link name='b'><inertial><mass value='x'/></inertial></link>"),
                 4, {"[b]"});
  expect_refused(robot(link("a", "<contact><lateral_friction value='high'/></contact>")), 3,
                 {"lateral_friction", "high", "number"});
  expect_refused(pair_with("continuous", "<origin xyz='0 0 ${x}'/>"), 5, {"xacro"});
  std::string deep = "<robot name='r'>";
  for (int i = 0; i < 10000; ++i) deep += "<a>";
  expect_refused(deep, 1, {"not well-formed XML"});
  EXPECT_THROW(load_urdf(folder_.path() / "none.urdf"), InputError);
  EXPECT_THROW(load_urdf(folder_.path()), InputError);
}

TEST_F(UrdfTest, LeavesTheConsoleAsItWas) {
  console_bridge::OutputHandler* const before = console_bridge::getOutputHandler();
  const auto level = console_bridge::getLogLevel();
  EXPECT_THROW(load(robot("")), InputError);
  EXPECT_EQ(console_bridge::getOutputHandler(), before);
  EXPECT_EQ(console_bridge::getLogLevel(), level);
}

}  // namespace
}  // namespace counterpoint::urdf_test
