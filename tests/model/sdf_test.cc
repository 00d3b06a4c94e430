// SDF files: poses in other frames, joints of every kind, static models, includes and the files
// they may open.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/mass_matrix.h"
#include "support/temp_folder.h"

namespace counterpoint::sdf_test {
namespace {

using test::mass_matrix;

constexpr double kRoundOff =
    1e-12;  // round-off of chains of some ten joints and of 16 digits in a file
constexpr double kPi = 3.14159265358979323846;

class SdfTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string why = refusal("<model name='m'><link name='l'/></model>");
    if (why.find("built without SDF") != std::string::npos) GTEST_SKIP() << why;
  }
  std::filesystem::path write(const std::string& contents, const std::string& name = "m.sdf") {
    return folder_.write(name, "<?xml version='1.0'?>\n<sdf version='1.9'>" + contents + "</sdf>");
  }
  Scene scene(const std::string& contents) { return load_scene(write(contents)); }
  std::string refusal(const std::string& contents) {
    try {
      scene(contents);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  static Pose frame(const Scene& s, const std::string& name, const VectorX& q) {
    const Frame& f = s.model.frames().at(s.model.find_frame(name));
    return body_poses(s.model, q)[f.body] * f.X_BF;
  }
  static const Geometry& geometry(const Scene& s, const std::string& name) {
    for (const Geometry& g : s.model.geometries())
      if (g.name == name) return g;
    throw std::out_of_range(name);
  }
  static bool excluded(const Scene& s, const std::string& a, const std::string& b) {
    const auto index = [&](const std::string& name) {
      return static_cast<int>(&geometry(s, name) - s.model.geometries().data());
    };
    const std::pair<int, int> pair = std::minmax(index(a), index(b));
    const auto& all = s.model.excluded_geometry_pairs();
    return std::find(all.begin(), all.end(), pair) != all.end();
  }
  test::TempFolder folder_;
};

const char* const kLink =
    R"(<inertial><mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.3</iyy><izz>0.25</izz></inertia>
  </inertial>)";

/// A collision sphere with a radius of 1 cm at the link's origin.
std::string ball(const std::string& surface = "") {
  return "<collision name='c'><geometry><sphere><radius>0.01</radius></sphere></geometry>" +
         surface + "</collision>";
}

TEST_F(SdfTest, PosesAreRelativeToAnyFrame) {
  const Scene s = scene(std::string(R"(<model name='m'><pose>1 2 3 0 0 1.5707963267948966</pose>
    <frame name='f' attached_to='a'><pose>0 0 1 0 0 0</pose></frame>
    <link name='a'><pose>0 0 0.5 0 0 0</pose>)") +
                        kLink + R"(</link>
    <link name='b'><pose relative_to='f'>0.25 0 0 0 0 0</pose>)" +
                        kLink + R"(</link>
    <joint name='j' type='revolute'><pose relative_to='f'/><parent>a</parent><child>b</child>
      <axis><xyz expressed_in='__model__'>0 1 0</xyz></axis></joint></model>)");
  VectorX q = s.model.default_q();
  EXPECT_LT((frame(s, "a", q).translation - Vector3(1, 2, 3.5)).norm(), kRoundOff);
  EXPECT_LT((frame(s, "b", q).translation - Vector3(1, 2.25, 4.5)).norm(), kRoundOff);
  // The model's y axis is the world's -x, about which the joint rotates b from y to -z.
  q[s.model.body(s.model.find_joint("j") + 1).q_index] = 0.5 * kPi;
  EXPECT_LT((frame(s, "b", q).translation - Vector3(1, 2, 4.25)).norm(), kRoundOff);
}

TEST_F(SdfTest, PlacementFramesLieWhereThePoseSays) {
  const Scene s = scene(
      std::string(
          "<model name='m' placement_frame='tool'><pose>1 2 3 0 0 0</pose><link name='a'>") +
      kLink + "</link><frame name='tool' attached_to='a'><pose>0 0 1 0 0 0</pose></frame></model>");
  EXPECT_LT((frame(s, "a", s.q).translation - Vector3(1, 2, 2)).norm(), kRoundOff);
}

TEST_F(SdfTest, InertiasAreTurnedAndNotDoubted) {
  const Scene s =
      scene(R"(<model name='m'><link name='a'><inertial><pose>0.5 0 0 0 0 1.5707963267948966</pose>
    <mass>2</mass><inertia><ixx>0.1</ixx><iyy>5</iyy><izz>0.2</izz></inertia></inertial></link></model>)");
  const SpatialInertia& inertia = s.model.body(1).inertia;
  EXPECT_EQ(inertia.mass, 2.0);
  EXPECT_LT((inertia.center - Vector3(0.5, 0, 0)).norm(), kRoundOff);
  EXPECT_NEAR(inertia.rotational(0, 0), 5.0, kRoundOff);
  EXPECT_NEAR(inertia.rotational(1, 1), 0.1, kRoundOff);
}

TEST_F(SdfTest, JointsKnowLimitsForcesAndSprings) {
  const Scene s = scene(
      std::string("<model name='m'><link name='a'>") + kLink + "</link><link name='b'>" + kLink +
      R"(</link><joint name='w' type='fixed'><parent>world</parent><child>a</child></joint>
    <joint name='j' type='prismatic'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz>
      <limit><lower>-1</lower><upper>2</upper><effort>3</effort><velocity>4</velocity></limit>
      <dynamics><damping>5</damping><friction>6</friction><spring_reference>7</spring_reference>
        <spring_stiffness>8</spring_stiffness></dynamics></axis></joint></model>)");
  ASSERT_EQ(s.model.num_joints(), 1);
  const JointInfo& joint = s.model.joint(0);
  EXPECT_EQ(joint.lower, -1.0);
  EXPECT_EQ(joint.upper, 2.0);
  EXPECT_EQ(joint.effort_limit, 3.0);
  EXPECT_EQ(joint.velocity_limit, 4.0);
  EXPECT_EQ(s.model.damping()[0], 5.0);
  EXPECT_EQ(s.model.dry_friction()[0], 6.0);
  ASSERT_EQ(s.model.springs().size(), 1u);
  EXPECT_EQ(s.model.springs()[0].reference, 7.0);
  EXPECT_EQ(s.model.springs()[0].stiffness, 8.0);
}

TEST_F(SdfTest, UniversalJointsTurnAboutOneAxisAfterTheOther) {
  const Scene s =
      scene(std::string("<model name='m'><link name='a'>") + kLink +
            R"(</link><joint name='u' type='universal'><parent>world</parent><child>a</child>
    <axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2></joint></model>)");
  ASSERT_EQ(s.model.nv(), 2);
  const VectorX q = (VectorX(2) << 0.3, -0.4).finished();
  const Matrix3 expected =
      (Eigen::AngleAxisd(0.3, Vector3::UnitX()) * Eigen::AngleAxisd(-0.4, Vector3::UnitY()))
          .matrix();
  EXPECT_LT((frame(s, "a", q).rotation - expected).norm(), kRoundOff);
}

/// The child of a joint is nearer to the world than its parent: the joint is reversed.
TEST_F(SdfTest, JointsThatPointInwardMoveTheSameWay) {
  const std::string links =
      std::string("<link name='a'>") + kLink + "</link><link name='b'><pose>1 0 0 0 0 0</pose>" +
      kLink + "</link><joint name='w' type='fixed'><parent>world</parent><child>a</child></joint>";
  const std::string axis =
      "<axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>";
  const Scene out = scene("<model name='m'>" + links +
                          "<joint name='j' type='revolute'><pose relative_to='a'/>"
                          "<parent>a</parent><child>b</child>" +
                          axis + "</model>");
  const Scene in = scene("<model name='m'>" + links +
                         "<joint name='j' type='revolute'><pose relative_to='a'/>"
                         "<parent>b</parent><child>a</child>" +
                         axis + "</model>");
  const VectorX q = VectorX::Constant(1, 0.5);
  EXPECT_LT((frame(out, "b", q).translation - Vector3(std::cos(0.5), std::sin(0.5), 0)).norm(),
            kRoundOff);
  EXPECT_LT((frame(in, "b", q).translation - Vector3(std::cos(0.5), -std::sin(0.5), 0)).norm(),
            kRoundOff);
  EXPECT_LT((mass_matrix(in.model, q) - mass_matrix(out.model, q)).norm(), kRoundOff);
  EXPECT_EQ(in.model.joint(0).lower, -1.0);
  EXPECT_EQ(in.model.joint(0).upper, 2.0);
}

/// A four-bar linkage: the last joint closes it, as a hinge about its axis.
TEST_F(SdfTest, LoopsBecomeClosures) {
  const auto bar = [](const char* name, const char* pose) {
    return std::string("<link name='") + name + "'><pose>" + pose + "</pose>" + kLink + "</link>";
  };
  const auto hinge = [](const char* name, const char* parent, const char* child,
                        const char* pose = "") {
    return std::string("<joint name='") + name + "' type='revolute'>" + pose + "<parent>" + parent +
           "</parent><child>" + child + "</child><axis><xyz>0 1 0</xyz></axis></joint>";
  };
  const Scene s =
      scene("<model name='m'>" + bar("left", "0 0 0 0 0 0") + bar("top", "0 0 1 0 0 0") +
            bar("right", "1 0 0 0 0 0") + hinge("a", "world", "left") + hinge("b", "left", "top") +
            hinge("c", "world", "right") + hinge("d", "right", "top", "<pose>1 0 0 0 0 0</pose>") +
            "</model>");
  EXPECT_EQ(s.model.nv(), 3);
  ASSERT_EQ(s.model.closures().size(), 1u);
  const Closure& closure = s.model.closures()[0];
  EXPECT_EQ(closure.type, ClosureType::kHinge);
  const auto X = body_poses(s.model, s.q);
  EXPECT_LT(closure_gap(closure, X).largest(), kRoundOff);
  const Pose at = X[closure.body_a] * closure.X_AC;
  EXPECT_LT((at.translation - Vector3(1, 0, 1)).norm(), kRoundOff);
  EXPECT_LT((at.rotation.col(2) - Vector3::UnitY()).norm(), kRoundOff);
}

TEST_F(SdfTest, StaticModelsAreTheEnvironment) {
  const Scene s = scene(std::string(R"(<world name='w'><gravity>0 0 -1.5</gravity>
    <physics name='p' type='ode'><max_step_size>0.004</max_step_size></physics>
    <model name='ground'><static>true</static><pose>0 0 0.5 0 0 0</pose><link name='l'><collision name='c'>
      <geometry><plane><normal>1 0 0</normal></plane></geometry></collision></link></model>
    <model name='ball'><pose>0 0 3 0 0 0</pose><link name='body'>)") +
                        kLink + ball() + "</link></model></world>");
  EXPECT_EQ(s.options.time_step, 0.004);
  EXPECT_EQ(s.model.gravity(), Vector3(0, 0, -1.5));
  EXPECT_EQ(s.model.nv(), 6);
  const Geometry& plane = geometry(s, "ground/l/c");
  EXPECT_EQ(plane.body, 0);
  EXPECT_LT((plane.X_BG.rotation.col(2) - Vector3::UnitX()).norm(), kRoundOff);
  EXPECT_EQ(plane.X_BG.translation.z(), 0.5);
  EXPECT_EQ(geometry(s, "ball/body/c").body, 1);
  EXPECT_NE(s.model.find_joint("ball/body"), -1);
}

TEST_F(SdfTest, JointsToStaticModelsLeadToTheWorld) {
  const Scene s = scene(std::string("<model name='m'><link name='a'>") + kLink + ball() +
                        "</link><model name='frame'><static>true</static><link name='f'>" + ball() +
                        R"(</link></model><joint name='j' type='revolute'><parent>frame::f</parent>
    <child>a</child><axis><xyz>0 1 0</xyz></axis></joint></model>)");
  EXPECT_EQ(s.model.nv(), 1);
  EXPECT_EQ(geometry(s, "frame/f/c").body, 0);
  EXPECT_EQ(geometry(s, "a/c").body, 1);
}

TEST_F(SdfTest, OfTwoSurfacesTheSmallerFrictionAndBounceCount) {
  const std::string rough =
      "<surface><friction><ode><mu>0.9</mu></ode></friction><bounce>"
      "<restitution_coefficient>0.8</restitution_coefficient><threshold>0</threshold></bounce></"
      "surface>";
  const std::string smooth =
      "<surface><friction><ode><mu>0.1</mu><mu2>0.1</mu2></ode><torsional><coefficient>0.5</"
      "coefficient>"
      "<patch_radius>0.02</patch_radius></torsional></friction></surface>";
  const Scene s = scene(std::string("<world name='w'><model name='a'><link name='l'>") + kLink +
                        ball(rough) + "</link></model><model name='b'><link name='l'>" + kLink +
                        ball(smooth) + "</link></model></world>");
  ASSERT_EQ(s.model.pair_materials().size(), 1u);
  EXPECT_EQ(s.model.pair_materials()[0].material.friction, 0.1);
  EXPECT_EQ(s.model.pair_materials()[0].material.restitution, 0.0);
  EXPECT_NEAR(geometry(s, "b/l/c").material.torsional_friction, 3 * kPi / 16 * 0.5 * 0.02,
              kRoundOff);
  // Without a threshold nothing bounces, as the SDF format states.
  const Scene t = scene(std::string("<model name='a'><link name='l'>") + kLink +
                        ball("<surface><bounce><restitution_coefficient>0.8</"
                             "restitution_coefficient></bounce></surface>") +
                        "</link></model>");
  EXPECT_EQ(geometry(t, "l/c").material.restitution, 0.0);
  EXPECT_EQ(geometry(t, "l/c").material.friction, 1.0);
}

TEST_F(SdfTest, KpAndKdAreASpringUnlessTheSurfaceBounces) {
  const auto surface = [&](const std::string& inner) {
    return geometry(scene(std::string("<model name='a'><link name='l'>") + kLink +
                          ball("<surface>" + inner + "</surface>") + "</link></model>"),
                    "l/c")
        .material;
  };
  const std::string spring = "<contact><ode><kp>20000</kp><kd>30</kd></ode></contact>";
  EXPECT_EQ(surface(spring).stiffness, 20000.0);
  EXPECT_EQ(surface(spring).damping, 30.0);
  EXPECT_FALSE(surface("<contact><ode><kp>1e12</kp></ode></contact>").is_soft());
}

TEST_F(SdfTest, LinksOfAModelTouchWhereItSaysSo) {
  const auto model = [](const char* flag) {
    std::string out = "<model name='m'>" + std::string(flag);
    for (const char* name : {"a", "b", "c"})
      out += std::string("<link name='") + name + "'>" + kLink + ball() + "</link>";
    return out + "<joint name='j' type='ball'><parent>a</parent><child>b</child></joint></model>";
  };
  const Scene apart = scene(model("")),
              touching = scene(model("<self_collide>true</self_collide>"));
  EXPECT_TRUE(excluded(apart, "a/c", "c/c"));
  EXPECT_FALSE(excluded(touching, "a/c", "c/c"));
  EXPECT_TRUE(excluded(touching, "a/c", "b/c"));
}

TEST_F(SdfTest, BitmasksDecideWhatTouches) {
  const auto with = [](const char* bits) {
    return ball(std::string("<surface><contact><collide_bitmask>") + bits +
                "</collide_bitmask></contact></surface>");
  };
  std::string world = "<world name='w'>";
  for (const auto& [name, bits] : {std::pair("a", "1"), {"b", "2"}, {"c", "3"}, {"d", "0"}})
    world += std::string("<model name='") + name + "'><link name='l'>" + kLink + with(bits) +
             "</link></model>";
  const Scene s = scene(world + "</world>");
  EXPECT_EQ(s.model.geometries().size(), 3u);  // d collides with nothing
  EXPECT_TRUE(excluded(s, "a/l/c", "b/l/c"));
  EXPECT_FALSE(excluded(s, "a/l/c", "c/l/c"));
}

TEST_F(SdfTest, ModelsWithinModelsAreOne) {
  folder_.write("gripper/model.config", "<model><sdf version='1.9'>model.sdf</sdf></model>");
  write(std::string("<model name='gripper'><link name='palm'>") + kLink + "</link></model>",
        "gripper/model.sdf");
  const Scene s = scene(std::string("<model name='arm'><link name='a'>") + kLink + R"(</link>
    <include><uri>model://gripper</uri><name>left</name><pose>0 0 2 0 0 0</pose></include>
    <joint name='j' type='fixed'><parent>a</parent><child>left::palm</child></joint></model>)");
  EXPECT_EQ(s.model.nv(), 6);
  EXPECT_EQ(s.model.body(1).inertia.mass, 4.0);
  EXPECT_LT((frame(s, "left/palm", s.q).translation - Vector3(0, 0, 2)).norm(), kRoundOff);
}

TEST_F(SdfTest, IncludesStayInTheirFolders) {
  const test::TempFolder elsewhere;
  elsewhere.write("secret/model.config", "<model><sdf version='1.9'>model.sdf</sdf></model>");
  const std::string model =
      "<?xml version='1.0'?><sdf version='1.9'><model name='s'><link name='l'>" +
      std::string(kLink) + "</link></model></sdf>";
  elsewhere.write("secret/model.sdf", model);
  const std::string path = elsewhere.path().string();
  const auto include = [](const std::string& uri) {
    return "<world name='w'>\n<include><uri>" + uri + "</uri></include></world>";
  };
  // For a file in worlds/, the folder above is its package.
  const auto refused = [&](const std::string& uri) {
    try {
      load_scene(write(include(uri), "worlds/m.sdf"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(refused("file://" + path + "/secret/model.sdf").find("outside"), std::string::npos);
  EXPECT_NE(refused("file://" + path + "/secret").find("m.sdf:3: <include>"), std::string::npos);
  EXPECT_NE(refusal(include("model://secret")).find("package 'secret' is not listed"),
            std::string::npos);
  EXPECT_NE(
      refusal(include("https://fuel.gazebosim.org/1.0/openrobotics/models/x")).find("not fetched"),
      std::string::npos);
  SceneOverrides allowed;
  allowed.packages["secret"] = elsewhere.path() / "secret";
  EXPECT_EQ(load_scene(write(include("model://secret")), allowed).model.nv(), 6);
  // The model.config of a model that refers to a file elsewhere.
  folder_.write("trap/model.config", "<model><sdf version='1.9'>../../" +
                                         elsewhere.path().filename().string() +
                                         "/secret/model.sdf</sdf></model>");
  EXPECT_NE(refused("model://trap").find("outside"), std::string::npos) << refused("model://trap");
  write(include("model://loop"), "loop/model.sdf");
  folder_.write("loop/model.config", "<model><sdf version='1.9'>model.sdf</sdf></model>");
  EXPECT_NE(refusal(include("model://loop")).find("includes itself"), std::string::npos);
}

/// Elements that would change the motion are rejected with file, line and name.
TEST_F(SdfTest, RefusesWhatItCannotDo) {
  const auto with = [](const std::string& link, const std::string& rest = "") {
    return "<model name='m'>\n<link name='a'>" + std::string(kLink) + link +
           "</link><link name='b'>" + kLink + "</link>" + rest + "</model>";
  };
  const auto joint = [](const std::string& type, const std::string& rest = "") {
    return "\n<joint name='j' type='" + type +
           "'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis>" +
           "<axis2><xyz>0 1 0</xyz></axis2>" + rest + "</joint>";
  };
  const std::pair<std::string, const char*> cases[] = {
      {with("", joint("screw")), "m.sdf:6: <joint> 'j': type 'screw' is not supported"},
      {with("", joint("gearbox", "<gearbox_reference_body>a</gearbox_reference_body>")),
       "'gearbox' is not supported"},
      {with("<kinematic>true</kinematic>"), "m.sdf:3: <link> 'a': <kinematic>"},
      {with("\n<velocity_decay><linear>0.1</linear></velocity_decay>"),
       "<velocity_decay>: <linear>"},
      {with(ball("\n<surface><friction><ode><mu>1</mu><mu2>0.5</mu2></ode></friction></surface>")),
       "without <fdir1>"},
      {with(ball("<surface><friction><ode><slip1>0.1</slip1></ode></friction></surface>")),
       "<slip1>"},
      {with("<collision name='c'><geometry><plane/></geometry></collision>"),
       "a plane on a model that can move"},
      {with("<collision name='c'><geometry><polyline><point>0 0</point><point>0 1</point><point>1 "
            "0</point>"
            "<height>1</height></polyline></geometry></collision>"),
       "polyline"},
      {"<world name='w'><population name='p'/></world>", "<population>"},
      {"<model name='m'><link name='a'/></model><model name='n'><link name='a'/></model>",
       "2 models or worlds"},
      {"<model name='m'><link name='a'><inertial><mass>x</mass></inertial></link></model>",
       "m.sdf:2: Error reading element <mass>"},
      {"<model name='m'/>", "link"},
      {with("", joint("revolute2", "<axis><mimic joint='k'/></axis>")),
       "<mimic>: a joint that follows another"},
      {"<model name='m'><link name='a'><inertial auto='true'/></link></model>",
       "no <collision> with a volume"},
      {"<world name='w'><joint name='j' type='fixed'/></world>", "<joint>: joints of a world"},
      {"<light name='l' type='point'/>", "no <world> and no <model>"},
  };
  for (const auto& [contents, part] : cases)
    EXPECT_NE(refusal(contents).find(part), std::string::npos) << part << "\n" << refusal(contents);
}

TEST_F(SdfTest, ScenesPlaceThem) {
  write(std::string("<model name='arm'><link name='a'>") + kLink +
        "</link><joint name='j' type='prismatic'>"
        "<parent>world</parent><child>a</child><axis><xyz>1 0 0</xyz></axis></joint></model>");
  const Scene s = load_scene(folder_.write("s.yaml",
                                           "models:\n  - {sdf: m.sdf, name: one, position: [0, 0, "
                                           "1], joints: {j: 0.5}, joint_velocities: {j: 2}}\n"
                                           "  - {sdf: m.sdf, name: two}\n"));
  EXPECT_EQ(s.model.nv(), 2);
  EXPECT_LT((frame(s, "one/a", s.q).translation - Vector3(0.5, 0, 1)).norm(), kRoundOff);
  EXPECT_EQ(s.v[0], 2.0);
  EXPECT_EQ(s.model.gravity().z(), -kStandardGravity);
}

}  // namespace
}  // namespace counterpoint::sdf_test
