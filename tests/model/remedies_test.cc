// Options that make rejected files loadable, and scenes built in code.
#include <gtest/gtest.h>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::remedies_test {
namespace {

const std::string kInertial =
    "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
    "</inertial>";

bool noted(const std::vector<Note>& notes, const std::string& text) {
  for (const Note& note : notes)
    if ((note.where + ": " + note.message).find(text) != std::string::npos) return true;
  return false;
}

class Remedies : public testing::Test {
 protected:
  Scene load(const std::string& urdf, const SceneOverrides& overrides = {}) const {
    return load_scene(folder_.write("r.urdf", urdf), overrides);
  }
  Scene scene(const std::string& yaml) const { return load_scene(folder_.write("s.yaml", yaml)); }
  /// Expects a rejection whose message names the option.
  void expect_refused(const std::string& urdf, const std::string& option) const {
    try {
      load(urdf);
      ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(option), std::string::npos) << error.what();
    }
  }
  test::TempFolder folder_;
};

TEST_F(Remedies, InertiaIsFilledWhereMotionWouldBeUndefined) {
  const std::string urdf =
      "<robot name='r'><link name='a'/><link name='b'>" + kInertial +
      "</link><link name='c'/><link name='d'/>"
      "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
      "<joint name='k' type='continuous'><parent link='b'/><child link='c'/></joint>"
      "<joint name='l' type='prismatic'><parent link='c'/><child link='d'/>"
      "<limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>";
  expect_refused(urdf, "--fill-inertia");
  SceneOverrides overrides;
  overrides.fill_inertia = 1e-3;
  const Model model = load(urdf, overrides).model;
  EXPECT_TRUE(noted(model.notes(), "link 'd'"));
  EXPECT_FALSE(noted(model.notes(), "link 'b'"));  // has inertia of its own
  // A ball of 1 g of water has a radius of 6.2 mm.
  const SpatialInertia& filled = model.body(3).inertia;
  EXPECT_EQ(filled.mass, 1e-3);
  EXPECT_NEAR(filled.rotational(0, 0), 0.4 * 1e-3 * 6.2035e-3 * 6.2035e-3, 1e-11);
  EXPECT_EQ(model.body(1).inertia.mass, 1.0);
  folder_.write("r.urdf", urdf);
  EXPECT_TRUE(noted(scene("fill_inertia: 1.0e-3\nmodels: [{urdf: r.urdf}]\n").model.notes(),
                    "filled in: 0.001 kg"));
}

/// An arm on a massless base whose axes nearly coincide in pairs.
std::string arm_on_nothing(int links, double tilt) {
  std::string out = "<robot name='r'><link name='l0'/>";
  for (int i = 1; i <= links; ++i) {
    const std::string name = "l" + std::to_string(i);
    out += "<link name='" + name +
           "'><inertial><origin xyz='0.01 0 -0.07'/><mass value='0.4'/><inertia ixx='0.001' "
           "ixy='0' ixz='0' iyy='0.001' iyz='0' izz='0.0005'/></inertial></link><joint name='j" +
           std::to_string(i) + "' type='continuous'><parent link='l" + std::to_string(i - 1) +
           "'/><child link='" + name + "'/><origin xyz='0.01 0 0.1' rpy='" + std::to_string(tilt) +
           " 0 0'/><axis xyz='" + (i % 2 == 1 ? "0 0 1" : "1 0 0") + "'/></joint>";
  }
  return out + "</robot>";
}

TEST_F(Remedies, MotionWithoutInertiaIsFoundAmongNearlyCoincidentAxes) {
  // The base can rotate about the first axis without moving any inertia. A check by elimination
  // alone mistook round-off for inertia.
  for (const auto& [links, tilt] : {std::pair(3, 0.0), std::pair(7, 0.0087), std::pair(9, 1e-5)}) {
    SceneOverrides overrides;
    overrides.base = Base::kFloating;
    try {
      load(arm_on_nothing(links, tilt), overrides);
      ADD_FAILURE() << "accepted: " << links << " links, tilted by " << tilt;
    } catch (const InputError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("r.urdf:1: joint 'l0'"), std::string::npos) << what;
      EXPECT_NE(what.find("--fill-inertia"), std::string::npos) << what;
    }
    overrides.fill_inertia = 1e-3;
    EXPECT_TRUE(noted(load(arm_on_nothing(links, tilt), overrides).model.notes(),
                      "link 'l0': has no inertia"));
  }
}

TEST_F(Remedies, LimitsTheWrongWayRoundAreExchanged) {
  const std::string urdf =
      "<robot name='r'><link name='a'/><link name='b'>" + kInertial +
      "</link><joint name='j' type='revolute'><parent link='a'/><child link='b'/>"
      "<limit lower='1' upper='-2' effort='1' velocity='1'/></joint></robot>";
  expect_refused(urdf, "--repair-joints");
  SceneOverrides overrides;
  overrides.repair_joints = true;
  const Model model = load(urdf, overrides).model;
  EXPECT_EQ(model.joint(0).lower, -2.0);
  EXPECT_EQ(model.joint(0).upper, 1.0);
  EXPECT_TRUE(noted(model.notes(), "exchanged: [-2, 1]"));
}

TEST_F(Remedies, JointsThatCannotFollowMoveByThemselves) {
  const auto urdf = [](const std::string& type) {
    return "<robot name='r'><link name='a'/><link name='b'>" + kInertial +
           "</link><link name='c'>" + kInertial + "</link><joint name='j' type='" + type +
           "'><parent link='a'/><child link='b'/></joint>"
           "<joint name='k' type='continuous'><parent link='b'/><child link='c'/>"
           "<mimic joint='j'/></joint></robot>";
  };
  SceneOverrides overrides;
  overrides.repair_joints = true;
  for (const char* type : {"floating", "fixed"}) {
    expect_refused(urdf(type), "--repair-joints");
    const Model model = load(urdf(type), overrides).model;
    EXPECT_TRUE(model.mimics().empty());
    EXPECT_TRUE(noted(model.notes(), "moves by itself"));
  }
  EXPECT_EQ(load(urdf("continuous"), overrides).model.mimics().size(), 1u);  // can follow
}

TEST_F(Remedies, ARobotWithoutANameIsCalledLikeItsFile) {
  for (const char* head : {"<robot>", "<robot name=''>"}) {
    const Scene robot = load(std::string(head) + "<link name='a'>" + kInertial + "</link></robot>");
    EXPECT_EQ(robot.name, "r");
    EXPECT_TRUE(noted(robot.model.notes(), "no name"));
  }
}

TEST_F(Remedies, PairsHaveSurfacesOfTheirOwn) {
  const Scene s = scene(R"(models:
  - {name: ice, box: [1, 1, 1], mass: 1, friction: 0.04}
  - {name: rubber, box: [1, 1, 1], mass: 1, position: [5, 0, 0], friction: 1}
  - {name: steel, box: [1, 1, 1], mass: 1, position: [9, 0, 0], friction: 0.25, restitution: 0.5}
groups: {hard: [ice/body, steel/body]}
ground: {friction: 1}
pairs:
  - {between: [hard, rubber/body], friction: 0.7}
  - {between: [ground, ice/body/shape], restitution: 0.9}
)");
  const auto pair = [&](int a, int b) { return s.model.pair_material(a, b); };
  EXPECT_EQ(pair(0, 1).friction, 0.7);
  EXPECT_EQ(pair(1, 0).friction, 0.7);
  EXPECT_EQ(pair(1, 2).friction, 0.7);
  EXPECT_EQ(pair(1, 2).restitution, 0.5);  // values not given are combined
  EXPECT_EQ(pair(0, 2).friction, 0.1);
  EXPECT_EQ(pair(0, 3).friction, 0.2);
  EXPECT_EQ(pair(0, 3).restitution, 0.9);
  EXPECT_EQ(pair(1, 3).friction, 1.0);
  EXPECT_EQ(s.model.pair_materials().size(), 3u);
}

TEST_F(Remedies, SeveralPlanes) {
  const Scene s = scene(R"(ground: {}
environment:
  - {name: ramp, plane: [0, 1, 1], position: [0, 0, 0.5], friction: 0.1}
  - {name: wall, plane: [-3, 0, 0], position: [2, 0, 0]}
)");
  ASSERT_EQ(s.model.geometries().size(), 3u);
  const double half = std::sqrt(0.5);
  EXPECT_LT((s.model.geometries()[1].X_BG.rotation.col(2) - Vector3(0, half, half)).norm(), 1e-15);
  EXPECT_LT((s.model.geometries()[2].X_BG.rotation.col(2) - Vector3(-1, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(s.model.geometries()[1].material.friction, 0.1);
  EXPECT_THROW(scene("environment: [{name: p, plane: [0, 0, 0]}]\n"), InputError);
  EXPECT_THROW(scene("models: [{name: p, plane: [0, 0, 1], mass: 1}]\n"), InputError);
}

TEST(SceneInCode, IsTheWorldAloneOrWhatWasBuilt) {
  Scene scene;
  EXPECT_EQ(scene.model.num_bodies(), 1);
  EXPECT_EQ(scene.q.size(), 0);
  ModelBuilder builder;
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  const Shape ball{ShapeType::kSphere, Vector3(0.1, 0, 0), nullptr};
  builder.add_robot(object_of("ball", ball, 2.0), Base::kFloating,
                    {Matrix3::Identity(), Vector3(0, 0, 1)});
  scene = scene_of(builder.build(), "ball");
  EXPECT_EQ(scene.q.size(), 7);
  EXPECT_EQ(scene.v.size(), 6);
  EXPECT_EQ(scene.q[2], 1.0);
  EXPECT_EQ(scene.model.body(1).inertia.mass, 2.0);
  EXPECT_THROW(object_of("floor", {ShapeType::kPlane, {}, nullptr}, 1.0), InputError);
}

}  // namespace
}  // namespace counterpoint::remedies_test
