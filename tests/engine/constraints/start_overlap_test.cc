// Bodies that touch or overlap at the start: pairs left out, pairs that collide, and notes on both.
#include <gtest/gtest.h>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::start_overlap_test {
namespace {

/// Soft contacts sink by eps g h^2 = 4e-8 m under one cube and twice that under two; overlaps heal
/// within the run.
constexpr double kSink = 1e-6;  // [m]

class StartOverlap : public testing::Test {
 protected:
  Scene load(const std::string& name, const std::string& text) {
    return load_scene(folder_.write(name, text));
  }
  /// Returns the height of a link after 1 s [m].
  static double height(const Scene& scene, const std::string& link) {
    Simulator simulator(scene);
    while (simulator.state().time < 1.0)
      if (!simulator.step().succeeded()) throw std::runtime_error("a step failed");
    return simulator.frame(link).X_WF.translation.z();
  }
  static std::string notes(const Model& model) {
    std::string all;
    for (const Note& note : collision::all_notes(model))
      all += note.where + ": " + note.message + "\n";
    return all;
  }
  static void expect_note(const Model& model, const std::vector<std::string>& words) {
    for (const std::string& word : words)
      EXPECT_NE(notes(model).find(word), std::string::npos) << word << " in " << notes(model);
  }
  static void expect_nothing_said_of_pairs(const Model& model) {
    for (const char* word : {"left out: ", "start: "})
      EXPECT_EQ(notes(model).find(word), std::string::npos) << notes(model);
  }
  test::TempFolder folder_;
};

const std::string kTwoCubes = R"(<mujoco><worldbody><geom name="floor" type="plane" size="5 5 .1"/>
  <body name="low" pos="0 0 0.05"><freejoint/><geom name="l" type="box" size="0.05 0.05 0.05" mass="1"/></body>
  <body name="high" pos="0 0 0.149"><freejoint/><geom name="h" type="box" size="0.05 0.05 0.05" mass="1"/></body>
  </worldbody></mujoco>)";

TEST_F(StartOverlap, StackedCubesOfOneMjcfFileStandOnEachOther) {
  const Scene alone = load("two.xml", kTwoCubes);
  EXPECT_NEAR(height(alone, "high"), 0.15, kSink);
  expect_nothing_said_of_pairs(alone.model);
  EXPECT_NEAR(height(load("s.yaml", "models: [{mjcf: two.xml}]"), "high"), 0.15, kSink);
}

TEST_F(StartOverlap, StackedCubesOfOneUrdfStandOnEachOther) {
  const auto cube = [](const std::string& name) {
    return "<link name='" + name +
           "'><inertial><mass value='1'/><inertia ixx='0.002' iyy='0.002' izz='0.002' ixy='0' "
           "ixz='0' iyz='0'/>"
           "</inertial><collision><geometry><box size='0.1 0.1 "
           "0.1'/></geometry></collision></link>";
  };
  const auto joint = [](const std::string& child, const std::string& type, const std::string& z) {
    return "<joint name='to_" + child + "' type='" + type +
           "'><parent link='world'/><child link='" + child + "'/><origin xyz='0 0 " + z +
           "'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='9' velocity='9'/></joint>";
  };
  // The floor is a shape of the link "world".
  const std::string world =
      "<link name='world'><collision><origin xyz='0 0 -0.5'/><geometry><box size='4 4 "
      "1'/></geometry></collision></link>";
  for (const std::string type : {"floating", "prismatic"}) {
    const Scene scene = load("two.urdf", "<robot name='two'>" + world + cube("low") + cube("high") +
                                             joint("low", type, "0.05") +
                                             joint("high", type, "0.149") + "</robot>");
    EXPECT_NEAR(height(scene, "high"), 0.15, kSink) << type;
    expect_nothing_said_of_pairs(scene.model);
  }
}

TEST_F(StartOverlap, StackedCubesOfOneSdfModelStandOnEachOtherWhereItSaysSelfCollide) {
  const auto cube = [](const std::string& name, const std::string& z) {
    return "<link name='" + name + "'><pose>0 0 " + z +
           " 0 0 "
           "0</pose><inertial><mass>1</mass><inertia><ixx>0.002</ixx><iyy>0.002</iyy><izz>0.002</"
           "izz></inertia>"
           "</inertial><collision name='c'><geometry><box><size>0.1 0.1 "
           "0.1</size></box></geometry></collision></link>"
           "<joint name='to_" +
           name + "' type='prismatic'><parent>world</parent><child>" + name +
           "</child><axis><xyz>0 0 1</xyz></axis></joint>";
  };
  const auto world = [&](const std::string& self_collide) {
    return load("m.sdf",
                "<?xml version='1.0'?><sdf version='1.9'><world name='w'><model "
                "name='floor'><static>1</static>"
                "<link name='l'><collision "
                "name='c'><geometry><plane/></geometry></collision></link></model>"
                "<model name='m'>" +
                    self_collide + cube("low", "0.05") + cube("high", "0.149") +
                    "</model></world></sdf>");
  };
  try {
    EXPECT_NEAR(height(world("<self_collide>1</self_collide>"), "m/high"), 0.15, kSink);
  } catch (const InputError& error) {
    if (std::string(error.what()).find("built without SDF") != std::string::npos)
      GTEST_SKIP() << error.what();
    throw;
  }
  const Scene apart = world("");
  EXPECT_NEAR(height(apart, "m/high"), 0.05, kSink);
  expect_note(apart.model, {"'m/low' and 'm/high', never touch", "self_collide"});
}

// A gripper closes on a part with 0.1 mm of preload: the part hangs, although it overlaps the
// fingers at the start.
TEST_F(StartOverlap, APartGraspedWithPreloadIsHeld) {
  const Scene scene = load("grip.xml", R"(<mujoco><worldbody>
    <body name="left" pos="-0.03 0 1">
      <joint name="l" type="slide" axis="1 0 0" damping="50" stiffness="2000" springref="0.01"/>
      <geom type="box" size="0.01 0.02 0.02" mass="0.1"/></body>
    <body name="right" pos="0.03 0 1">
      <joint name="r" type="slide" axis="-1 0 0" damping="50" stiffness="2000" springref="0.01"/>
      <geom type="box" size="0.01 0.02 0.02" mass="0.1"/></body>
    <body name="part" pos="0 0 1"><freejoint/><geom type="box" size="0.0201 0.01 0.01" mass="0.1"/></body>
    </worldbody></mujoco>)");
  // 20 N on either side hold a weight of 1 N: the part creeps by nanometres.
  EXPECT_NEAR(height(scene, "part"), 1.0, kSink);
}

/// Three links in a chain of revolute joints; the third one's shape lies within the first one's.
/// `contact` is the file's contact section.
std::string folded_arm(const std::string& contact) {
  return R"(<mujoco><option gravity="0 0 0"/><worldbody>
    <body name="a"><joint axis="0 1 0"/><geom name="a" size="0.1" mass="1"/>
    <body name="b" pos="0.3 0 0"><joint axis="0 1 0"/><geom name="b" size="0.05" mass="1"/>
    <body name="c" pos="-0.2 0 0"><joint axis="0 1 0"/><geom name="c" size="0.05" mass="1"/>
    </body></body></body></worldbody>)" +
         contact + "</mujoco>";
}

TEST_F(StartOverlap, LinksOfOneTreeThatOverlapAreLeftOutAndNamed) {
  const Scene scene = load("arm.xml", folded_arm(""));
  const collision::Collider collider(scene.model);
  EXPECT_EQ(collider.overlapping_pairs(), (std::vector<std::pair<int, int>>{{0, 2}}));
  EXPECT_FALSE(collider.may_touch(0, 2));
  expect_note(scene.model, {"left out", "'a/a' and 'c/c'", "collide: true", "<pair>"});
}

TEST_F(StartOverlap, ExplicitPairsAreNeverLeftOut) {
  const Scene mjcf =
      load("arm.xml",
           folded_arm("<contact><pair geom1='a' geom2='c'/><pair geom1='a' geom2='b'/></contact>"));
  folder_.write("plain.xml", folded_arm(""));
  const Scene yaml = load("s.yaml", R"(models: [{mjcf: plain.xml}]
pairs: [{between: [a, c], collide: true}, {between: [b, a], collide: true, friction: 0.2}]
exclude: [[a, b]])");
  for (const Scene* scene : {&mjcf, &yaml}) {
    const collision::Collider collider(scene->model);
    EXPECT_TRUE(collider.overlapping_pairs().empty());
    EXPECT_TRUE(collider.may_touch(0, 2));
    EXPECT_TRUE(collider.may_touch(0, 1));  // although a joint connects them
    EXPECT_FALSE(collider.may_touch(1, 2));
    EXPECT_EQ(collider.num_enabled_pairs(), 2);
    // The centres are 0.1 m apart, the radii 0.1 and 0.05 m.
    expect_note(scene->model, {"start", "'a/a' and 'c/c' by 0.05 m"});
  }
}

TEST_F(StartOverlap, ARobotStandsInTheFloorOfItsOwnFile) {
  // The base is part of the robot: a link attached to it may overlap it, and the pair is left out.
  // The floor is not part of the robot.
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial>";
  const auto link = [&](const std::string& name, const std::string& z) {
    return "<link name='" + name + "'>" + inertial + "<collision><origin xyz='0 0 " + z +
           "'/><geometry><sphere radius='0.1'/></geometry></collision></link>";
  };
  const auto joint = [](const std::string& parent, const std::string& child,
                        const std::string& type) {
    return "<joint name='to_" + child + "' type='" + type + "'><parent link='" + parent +
           "'/><child link='" + child + "'/></joint>";
  };
  const Scene scene =
      load("r.urdf",
           "<robot name='r'><link name='world'><collision><origin xyz='0 0 -1'/><geometry><box "
           "size='2 2 2'/>"
           "</geometry></collision></link>" +
               link("base", "0") + link("shoulder", "0.15") + link("elbow", "0.18") +
               joint("world", "base", "fixed") + joint("base", "shoulder", "continuous") +
               joint("shoulder", "elbow", "continuous") + "</robot>");
  const collision::Collider collider(scene.model);
  EXPECT_EQ(collider.overlapping_pairs(),
            (std::vector<std::pair<int, int>>{{1, 3}}));  // base and elbow
  EXPECT_FALSE(collider.may_touch(1, 2));
  EXPECT_TRUE(collider.may_touch(0, 2));
  EXPECT_TRUE(collider.may_touch(0, 3));
}

TEST_F(StartOverlap, DeepStartsAreNotedOnceWithTheLikelyCause) {
  // Full lengths given where half lengths are expected.
  const std::string cube =
      "ground: {}\nmodels: [{name: cube, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.05]";
  expect_note(load("s.yaml", cube + "}]").model,
              {"start", "'cube/body/shape' and 'ground' by 0.05 m", "half lengths"});
  // Five pairs of neighbours, and the lowest cube with the ground.
  expect_note(load("s.yaml", cube + ", count: 6, spacing: [0, 0, 0.1]}]").model,
              {"'cube0/body/shape' and 'cube1/body/shape' by 0.1 m", "and 2 more"});
  const auto number = [&](const std::string& text) {
    return collision::all_notes(load("t.yaml", text).model).size();
  };
  EXPECT_EQ(
      number("ground: {}\nmodels: [{name: b, sphere: 0.1, mass: 1, position: [0, 0, 0.0999]}]"),
      0u);
  EXPECT_EQ(number("ground: {}\nmodels: [{name: b, sphere: 0.1, mass: 1, position: [0, 0, -5]}]"),
            1u);
}

}  // namespace
}  // namespace counterpoint::start_overlap_test
