// Scenes written as MJCF and read back have the same parts, and the same forces in a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/robot_files.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/temp_folder.h"

namespace counterpoint::written_models_test {
namespace {

/// Numbers have 17 digits; rotations pass through quaternions, and lengths of paths through sums of
/// a few numbers near one: some round-offs.
constexpr double kRoundOff = 1e-12;

class WrittenModels : public testing::Test {
 protected:
  /// A finger of three joints (knuckle, middle_joint, tip_joint) in its start pose, with `parts`.
  Scene finger(const std::string& parts) const {
    return load_scene(folder_.write(
        "scene.yaml", "time_step: 0.001\nmodels:\n  - {urdf: " + test::source_dir() +
                          "/data/robots/finger.urdf, position: [0, 0, 0.1], joints: {knuckle: "
                          "0.3, middle_joint: 0.4, tip_joint: 0.2}}\n" +
                          parts));
  }
  /// Writes a scene into exported_, and reads it.
  Scene written(const Scene& scene) {
    exported_ = export_mjcf(scene);
    return load_scene(folder_.write("scene.xml", exported_.text));
  }
  bool lost(const std::string& where, const std::string& what) const {
    return std::any_of(exported_.lost.begin(), exported_.lost.end(), [&](const Note& note) {
      return note.where.find(where) != std::string::npos &&
             note.message.find(what) != std::string::npos;
    });
  }
  /// Speeds after a step from random speeds, to a tolerance far below kRoundOff.
  static VectorX speeds_after_step(const Scene& scene) {
    Simulator sim(scene);
    sim.settings().tolerance = 1e-15;
    State state = sim.state();
    state.v = test::random_vector(scene.model.nv(), 7, 2.0);
    sim.set_state(state);
    EXPECT_TRUE(sim.step().succeeded());
    return sim.state().v;
  }
  static void expect_same_step(const Scene& scene, const Scene& back) {
    const VectorX v = speeds_after_step(scene);
    EXPECT_LE((v - speeds_after_step(back)).norm(), kRoundOff * (1.0 + v.norm()));
    Scene idle = scene;
    idle.options.effects = scene.options.effects.without({Effect::kTendons, Effect::kActuators});
    // The forces in question are felt, or else the comparison says nothing of them.
    EXPECT_GT((v - speeds_after_step(idle)).norm(), 1e-3);
  }

  test::TempFolder folder_;
  Exported exported_;
};

/// The lengths at the start and half a degree away.
void expect_same_lengths(const Scene& scene, const Scene& back, const Tendon& a, const Tendon& b) {
  for (const double turn : {0.0, 0.01}) {
    const VectorX q = scene.q.array() + turn, q_back = back.q.array() + turn;
    const double length = tendon_length(scene.model, a, q, body_poses(scene.model, q));
    EXPECT_NEAR(length, tendon_length(back.model, b, q_back, body_poses(back.model, q_back)),
                kRoundOff)
        << a.name;
  }
}

TEST_F(WrittenModels, TendonsHaveTheSameLengthsAndForces) {
  const Scene scene = finger(R"(
tendons:
  - name: sum
    joints: {knuckle: 0.5, middle_joint: -0.25, tip_joint: 0.1}
    stiffness: 3
    rest_length: [0.01, 0.02]
    damping: 0.02
    dry_friction: 0.01
    limits: [none, 2]
  - name: path
    path:
      - {point: [-0.006, 0, -0.02], link: base}
      - {cylinder: 0.005, link: base, rpy: [1.5708, 0.1, 0], side: [-0.02, 0, 0]}
      - {point: [-0.006, 0, 0.02], link: proximal}
      - {sphere: 0.004, link: middle}
      - {point: [-0.006, 0, 0.015], link: middle}
      - {pulley: 2}
      - {point: [0.1, 0, 0.2], link: world}
      - {point: [0, 0.01, 0.01], link: tip}
    stiffness: 200
    rest_length: 0.05
    limits: [0.001, 0.3]
  - name: pulled
    joints: {middle_joint: 0.01, tip_joint: 0.02}
    servo: {stiffness: 400, damping: 4, target: 0.05, speed: 0.5, force: [-1, 2]}
  - name: turned
    joints: {knuckle: 0.01, tip_joint: 0.03}
    servo: {damping: 20, speed: -0.7}
)");
  const Scene back = written(scene);
  ASSERT_EQ(back.model.tendons().size(), 4u);
  for (const Tendon& a : scene.model.tendons()) {
    const Tendon& b =
        back.model.tendons().at(static_cast<std::size_t>(back.model.find_tendon(a.name)));
    expect_same_lengths(scene, back, a, b);
    EXPECT_EQ(a.path.size(), b.path.size());
    EXPECT_EQ(a.wraps.size(), b.wraps.size());
    EXPECT_EQ(a.stiffness, b.stiffness);
    if (a.stiffness > 0.0) {
      EXPECT_EQ(std::pair(a.rest_shortest, a.rest_longest),
                std::pair(b.rest_shortest, b.rest_longest));
    }
    EXPECT_EQ(a.damping, b.damping);
    EXPECT_EQ(a.dry_friction, b.dry_friction);
    EXPECT_EQ(std::max(a.lower, -1e9), std::max(b.lower, -1e9));
    EXPECT_EQ(std::min(a.upper, 1e9), std::min(b.upper, 1e9));
    EXPECT_EQ(a.servo.stiffness, b.servo.stiffness);
    EXPECT_EQ(a.servo.damping, b.servo.damping);
    EXPECT_EQ(std::pair(a.servo.least, a.servo.most), std::pair(b.servo.least, b.servo.most));
    // The pull at length 0 is the same; how target and speed share it is not written.
    EXPECT_NEAR(a.servo.stiffness * (a.servo.any() ? a.servo.target : 0.0) +
                    a.servo.damping * a.servo.speed,
                b.servo.stiffness * (b.servo.any() ? b.servo.target : 0.0) +
                    b.servo.damping * b.servo.speed,
                kRoundOff);
  }
  expect_same_step(scene, back);
  EXPECT_FALSE(lost("tendon", ""));
}

TEST_F(WrittenModels, ServosKeepTheirSpeed) {
  const Scene scene = load_scene(folder_.write(
      "scene.yaml", "models:\n  - {urdf: " + test::source_dir() +
                        "/data/robots/finger.urdf, dynamics: {knuckle: {servo: {stiffness: 0.4, "
                        "damping: 0.01, position: 0.5, velocity: 3}}, tip_joint: {servo: "
                        "{stiffness: 0, damping: 0.01, velocity: -2}}}}\n"));
  const Scene back = written(scene);
  const VectorX v = speeds_after_step(scene);
  EXPECT_LE((v - speeds_after_step(back)).norm(), kRoundOff * (1.0 + v.norm()));
  EXPECT_FALSE(lost("joint", ""));
}

TEST_F(WrittenModels, TendonPartsThatMjcfLacksAreNamed) {
  const Scene scene = finger(R"(
tendons:
  - {name: negative, joints: {knuckle: -0.5, tip_joint: -0.1}, stiffness: 3, damping: 0.1}
  - {name: held, joints: {knuckle: 0.5, tip_joint: 0.1}, limits: [0.17, 0.17]}
)");
  const Scene back = written(scene);
  EXPECT_TRUE(lost("'negative'", "rest length is negative"));
  EXPECT_TRUE(lost("'held'", "equal limits"));
  EXPECT_EQ(back.model.tendons().at(1).damping, 0.1);  // in the order of names
  EXPECT_EQ(back.model.tendons().at(1).stiffness, 0.0);
}

/// A rod and a tendon may have one name: both are tendons in MJCF.
TEST_F(WrittenModels, RodsAndTendonsOfOneNameAreTwoTendons) {
  const Scene scene = finger(R"(
closures:
  - {type: distance, name: t, between: [world, tip], anchor_a: [0.2, 0, 0.2]}
tendons:
  - {name: t, joints: {knuckle: 0.5, tip_joint: 0.1}, damping: 0.1}
)");
  const std::string text = export_mjcf(scene).text;
  EXPECT_NE(text.find("<spatial name=\"t/rod\""), std::string::npos);
  EXPECT_NE(text.find("tendon1=\"t/rod\""), std::string::npos);
  EXPECT_NE(text.find("<fixed name=\"t\""), std::string::npos);
}

}  // namespace
}  // namespace counterpoint::written_models_test
