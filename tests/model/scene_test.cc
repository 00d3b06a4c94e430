#include "counterpoint/model/scene.h"

#include <gtest/gtest.h>

#include "support/temp_folder.h"

namespace counterpoint::scene_test {
namespace {

constexpr double kRoundoff = 1e-13;

const char* const kCube = R"(<robot name="cube"><link name="body">
<inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><box size="0.2 0.2 0.4"/></geometry></collision></link></robot>)";

const char* const kArm = R"(<robot name="arm"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
</inertial><collision><origin xyz="0 0 -0.5"/><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.3"/><axis xyz="0 1 0"/></joint></robot>)";

class SceneTest : public testing::Test {
 protected:
  SceneTest() {
    folder_.write("cube.urdf", kCube);
    folder_.write("arm.urdf", kArm);
  }
  Scene load(const std::string& yaml, const SceneOverrides& overrides = {}) const {
    return load_scene(folder_.write("scene.yaml", yaml), overrides);
  }
  /// Expects a rejection whose message names this line of the file and contains every part.
  void expect_refused(const std::string& yaml, int line,
                      const std::vector<std::string>& parts) const {
    SCOPED_TRACE(yaml);
    try {
      load(yaml);
      ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("scene.yaml:" + std::to_string(line) + ":"), std::string::npos)
          << message;
      for (const std::string& part : parts) {
        EXPECT_NE(message.find(part), std::string::npos) << part << " is missing in: " << message;
      }
    }
  }
  test::TempFolder folder_;
};

TEST_F(SceneTest, ContactInOneWord) {
  const auto contact = [&](const std::string& text) {
    return load("models: [{name: ball, sphere: 0.1, mass: 1}]\n" + text).options.contact;
  };
  const ContactOptions usual, fast = contact("contact: fast\n"), hard = contact("contact: hard\n");
  EXPECT_EQ(contact("contact: default\n"), usual);
  EXPECT_EQ(fast.friction_model, FrictionModel::kConvex);
  EXPECT_EQ(fast.compliance, 0.1);
  EXPECT_EQ(hard.friction_model, FrictionModel::kCoulomb);
  EXPECT_LT(hard.compliance, usual.compliance);
  // Other keys override the preset, in any order.
  const ContactOptions mixed =
      contact("contact: {margin: 0.5, friction_model: lagged, preset: fast}\n");
  EXPECT_EQ(mixed.margin, 0.5);
  EXPECT_EQ(mixed.friction_model, FrictionModel::kLagged);
  EXPECT_EQ(mixed.compliance, 0.1);
}

constexpr const char* kEverything = R"(
name: all of it
gravity: [0, 0, -1.62]
time_step: 0.001
duration: 3
ground: {friction: 0.9, restitution: 0.1, height: -0.5, normal: [0, 1, 1]}
contact: {friction_model: coulomb, compliance: 1e-7, smoothing: 2e-6, stabilization: 0.1,
          max_recovery_speed: 2, margin: 0.02, reach_acceleration: 300,
          slip_time: 4}
defaults: {friction: 0.4}
models:
  - {urdf: cube.urdf, name: cube, base: floating, position: [0, 0, 0.5], rpy: [0, 0, 0.1],
     velocity: {linear: [1, 2, 3], angular: [4, 5, 6]}, friction: 0.7, restitution: 0.2}
  - urdf: arm.urdf
    name: arm
    quaternion: [2, 0, 0, 0]
    joints: {shoulder: 0.3}
    joint_velocities: {shoulder: -1.5}
  - {name: ball, sphere: 0.1, mass: 3, count: 3, spacing: [0, 0.5, 0], position: [2, 0, 1]}
environment:
  - {name: wall, box: [1, 0.1, 1], position: [0, 3, 0]}
exclude: [[wall, arm/upper], [ball0/body, ball1/body/shape]]
)";

TEST_F(SceneTest, ReadsEverything) {
  const Scene scene = load(kEverything);

  const Model& model = scene.model;
  EXPECT_EQ(scene.name, "all of it");
  EXPECT_EQ(model.gravity(), Vector3(0, 0, -1.62));
  EXPECT_EQ(scene.options.time_step, 0.001);
  EXPECT_EQ(scene.options.duration, 3.0);
  const ContactOptions& contact = scene.options.contact;
  EXPECT_EQ(contact.friction_model, FrictionModel::kCoulomb);
  EXPECT_EQ(contact.compliance, 1e-7);
  EXPECT_EQ(contact.smoothing, 2e-6);
  EXPECT_EQ(contact.stabilization, 0.1);
  EXPECT_EQ(contact.max_recovery_speed, 2.0);
  EXPECT_EQ(contact.margin, 0.02);
  EXPECT_EQ(contact.reach_acceleration, 300.0);
  EXPECT_EQ(contact.slip_time, 4.0);

  ASSERT_EQ(model.num_joints(), 5);
  EXPECT_EQ(model.joint(0).name, "cube/body");
  EXPECT_EQ(model.joint(1).name, "arm/shoulder");
  EXPECT_EQ(model.joint(4).name, "ball2/body");
  EXPECT_EQ(scene.q.head<3>(), Vector3(0, 0, 0.5));
  EXPECT_NEAR(scene.q[6], std::sin(0.05), kRoundoff);
  EXPECT_EQ(scene.v.head<6>(), (Vector6() << 1, 2, 3, 4, 5, 6).finished());
  EXPECT_EQ(scene.q[7], 0.3);
  EXPECT_EQ(scene.v[6], -1.5);
  EXPECT_LT((scene.q.segment<3>(22) - Vector3(2, 1, 1)).norm(), kRoundoff);
  EXPECT_EQ(model.body(3).inertia.mass, 3.0);
  EXPECT_NEAR(model.body(3).inertia.rotational(0, 0), 0.4 * 3 * 0.01, kRoundoff);

  ASSERT_EQ(model.geometries().size(), 7u);
  EXPECT_EQ(model.geometries()[0].material.friction, 0.7);
  EXPECT_EQ(model.geometries()[0].material.restitution, 0.2);
  EXPECT_EQ(model.geometries()[1].material.friction, 0.4);
  const Geometry& ground = model.geometries()[5];
  EXPECT_EQ(ground.name, "ground");
  EXPECT_EQ(ground.material.friction, 0.9);
  EXPECT_EQ(ground.X_BG.translation, Vector3(0, 0, -0.5));
  EXPECT_LT((ground.X_BG.rotation.col(2) - Vector3(0, 1, 1).normalized()).norm(), kRoundoff);
  EXPECT_EQ(model.geometries()[6].name, "wall");
  EXPECT_EQ(model.excluded_geometry_pairs(), (std::vector<std::pair<int, int>>{{1, 6}, {2, 3}}));
}

TEST_F(SceneTest, OneModelWithoutNameHasNoPrefix) {
  EXPECT_EQ(load("models: [{urdf: arm.urdf}]").model.joint(0).name, "shoulder");
  EXPECT_EQ(load("models: [{urdf: arm.urdf, name: left}]").model.joint(0).name, "left/shoulder");
  EXPECT_EQ(load("models: [{urdf: arm.urdf}, {urdf: cube.urdf}]").model.joint(0).name,
            "arm/shoulder");
  EXPECT_EQ(load("models: []").model.num_joints(), 0);
}

TEST_F(SceneTest, DefaultsAreThoseOfTheHeader) {
  const Scene scene = load("models: [{urdf: cube.urdf, base: floating}]");
  EXPECT_EQ(scene.options.time_step, SimulationOptions().time_step);
  EXPECT_EQ(scene.options.contact.compliance, ContactOptions().compliance);
  EXPECT_EQ(scene.model.geometries()[0].material.friction, Material().friction);
  EXPECT_EQ(scene.model.gravity(), Vector3(0, 0, -kStandardGravity));
  EXPECT_EQ(scene.v, VectorX::Zero(6));
}

TEST_F(SceneTest, ErrorsNameLineAndElement) {
  expect_refused("time_step: 0.1\ngravty: [0, 0, 1]\n", 2, {"gravty", "known", "gravity"});
  expect_refused("time_step: 0.1\ntime_step: 0.2\n", 2, {"time_step", "twice"});
  expect_refused("time_step: fast\n", 1, {"time_step", "number", "fast"});
  expect_refused("time_step: 0\n", 1, {"time_step", "positive"});
  expect_refused("time_step: .inf\n", 1, {"time_step"});
  expect_refused("\ngravity: [0, 1]\n", 2, {"gravity", "[x, y, z]"});
  expect_refused("contact: soft\n", 1, {"soft", "fast"});
  expect_refused("contact:\n  friction_model: dry\n", 2, {"dry", "coulomb"});
  expect_refused("contact:\n  stabilization: 2\n", 2, {"contact.stabilization", "0 ... 1"});
  expect_refused("models:\n  - {urdf: none.urdf}\n", 2, {"none.urdf", "no such file"});
  expect_refused("models:\n  - {urdf: arm.urdf, base: loose}\n", 2, {"base", "floating"});
  expect_refused("models:\n  - urdf: arm.urdf\n    joints: {elbow: 1}\n", 3, {"elbow", "shoulder"});
  expect_refused("models:\n  - urdf: arm.urdf\n    joints: {shoulder: [1, 2]}\n", 3, {"shoulder"});
  expect_refused("models:\n  - urdf: arm.urdf\n    joint_velocities: {elbow: 1}\n", 3, {"elbow"});
  expect_refused("models:\n  - urdf: arm.urdf\n    velocity: {linear: [1, 0, 0]}\n", 3, {"fixed"});
  expect_refused("models:\n  - {urdf: arm.urdf}\n  - {urdf: arm.urdf}\n", 3, {"arm/", "name"});
  expect_refused("models:\n  - {urdf: arm.urdf, base: floating}\n", 1, {"base"});
  expect_refused("models:\n  - {box: [1, 1, 1]}\n", 2, {"mass"});
  expect_refused("models:\n  - {box: [1, -1, 1], mass: 1}\n", 2, {"box", "positive"});
  expect_refused("models:\n  - {box: [1, 1, 1], sphere: 1, mass: 1}\n", 2, {"sphere", "box"});
  expect_refused("models:\n  - {mass: 1}\n", 2, {"shape"});
  expect_refused("models:\n  - {urdf: cube.urdf, count: 2}\n", 2, {"spacing"});
  expect_refused("models:\n  - {urdf: cube.urdf, rpy: [0, 0, 0], quaternion: [1, 0, 0, 0]}\n", 2,
                 {"either"});
  expect_refused("environment:\n  - {box: [1, 1, 1]}\n", 2, {"name"});
  expect_refused("ground: {friction: -1}\n", 1, {"friction"});
  expect_refused("ground: {}\nexclude:\n  - [ground, hand]\n", 3, {"hand"});
  expect_refused("models: {\n", 2, {"malformed"});
  expect_refused("- 1\n", 1, {"map"});
  EXPECT_THROW(load_scene(folder_.path() / "none.yaml"), InputError);
  EXPECT_THROW(load_scene(folder_.write("scene.txt", "")), InputError);
  SceneOverrides overrides;
  overrides.ground = true;
  EXPECT_THROW(load("time_step: 0.1", overrides), InputError);
}

TEST_F(SceneTest, LoneUrdf) {
  const Scene scene = load_scene(folder_.path() / "arm.urdf");
  EXPECT_EQ(scene.name, "arm");
  EXPECT_EQ(scene.model.nv(), 1);
  EXPECT_EQ(scene.model.geometries().size(), 1u);
}

TEST_F(SceneTest, LoneFloatingUrdfStartsJustAboveTheGround) {
  SceneOverrides overrides;
  overrides.base = Base::kFloating;
  overrides.ground = true;
  overrides.ground_friction = 0.3;
  const Scene scene = load_scene(folder_.path() / "cube.urdf", overrides);
  EXPECT_NEAR(scene.q[2], 0.2 + 0.001, kRoundoff);
  EXPECT_EQ(scene.model.geometries()[0].name, "ground");
  EXPECT_EQ(scene.model.geometries()[0].material.friction, 0.3);
}

}  // namespace
}  // namespace counterpoint::scene_test
