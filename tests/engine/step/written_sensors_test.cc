// Sensors written as MJCF and read back have the same readings.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "engine/sensors/sensed.h"
#include "engine/step/written.h"

namespace counterpoint::written_sensors_test {
namespace {

using test::kRoundOff;
using WrittenSensors = test::WrittenModels;

const char* const kSensors = R"(
environment:
  - {name: wall, box: [9, 9, 0.1], position: [0, 0, 1]}
sensors:
  - {name: imu, kind: imu, link: tip, position: [0, 0.01, 0.02], rpy: [0.3, 0.2, 0.1]}
  - {name: own speed, kind: linear_velocity, link: tip, position: [0, 0, 0.02], in: link}
  - {name: speed, kind: linear_velocity, link: tip, position: [0, 0, 0.02]}
  - {name: spin, kind: angular_velocity, link: middle}
  - {name: start of turn, kind: angular_acceleration, link: middle}
  - {name: feel, kind: specific_force, link: middle, position: [0.01, 0, 0]}
  - {name: turn, kind: orientation, link: middle, rpy: [0.1, 0.2, 0.3]}
  - {name: load, kind: wrench, link: middle}
  - {name: angle, kind: joint_position, joint: knuckle}
  - {name: rate, kind: joint_velocity, joint: tip_joint}
  - {name: effort, kind: joint_effort, joint: tip_joint}
  - {name: eye, kind: range, link: tip, axis: [0, 0.1, 1]}
  - {name: middle, kind: center_of_mass, link: middle}
  - {name: middle speed, kind: center_of_mass_velocity, link: middle}
  - {name: swing, kind: angular_momentum, link: proximal}
  - {name: all, kind: center_of_mass}
)";

const char* const kDriven = R"(
tendons:
  - name: cord
    path: [{point: [-0.006, 0, -0.02], link: base}, {point: [-0.006, 0, 0.015], link: tip}]
    stiffness: 9
actuators:
  - {name: lagged, tendon: cord, gear: 2, position: {stiffness: 0.5, damping: 0.01}, lag: 0.02}
sensors:
  - {name: length, kind: tendon_length, tendon: cord}
  - {name: stretching, kind: tendon_velocity, tendon: cord}
  - {name: travel, kind: actuator_position, actuator: lagged}
  - {name: travelling, kind: actuator_velocity, actuator: lagged}
  - {name: pull, kind: actuator_force, actuator: lagged}
)";

class WrittenReadings : public WrittenSensors, public testing::WithParamInterface<const char*> {};

TEST_P(WrittenReadings, AreTheSame) {
  const Scene scene = finger(GetParam());
  test::Sensed ours(scene), theirs(written(scene));
  for (test::Sensed* sensed : {&ours, &theirs}) {
    sensed->simulator.settings().tolerance = 1e-15;
    State state = sensed->simulator.state();
    state.v = test::random_vector(scene.model.nv(), 7, 2.0);
    sensed->simulator.set_state(state);
    sensed->step();
  }
  ASSERT_EQ(ours.table.size(), theirs.table.size());
  for (int i = 0; i < ours.table.size(); ++i) {
    // Kinds of one sensor, in their order, are sensors one after the other.
    const std::string name = ours.table.columns()[static_cast<std::size_t>(i)].name;
    const std::string other = theirs.table.columns()[static_cast<std::size_t>(i)].name;
    EXPECT_EQ(name.substr(0, name.find('.')), other.substr(0, other.find_first_of("/.")));
    EXPECT_EQ(name.substr(name.find('.')), other.substr(other.find('.')));
    // Accelerations divide round-offs of speeds by the step of 1 ms, and wrenches follow them.
    EXPECT_NEAR(ours.values[i], theirs.values[i],
                1e3 * kRoundOff * (1.0 + std::abs(ours.values[i])))
        << name;
  }
  EXPECT_FALSE(lost("sensor", ""));
}

INSTANTIATE_TEST_SUITE_P(Kinds, WrittenReadings, testing::Values(kSensors, kDriven));

/// The frame of a body is its link's where the joint is free; else a site has the link's axes.
TEST_F(WrittenSensors, ReferencesAreBodiesOrSites) {
  const Scene boxes = load_scene(folder_.write("boxes.yaml", R"(
models:
  - {name: a, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 1], rpy: [0.1, 0.2, 0.3]}
  - {name: b, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 2, 1]}
sensors:
  - {name: seen, kind: position, link: a/body, relative_to: b/body}
)"));
  const Scene back = written(boxes);
  test::Sensed ours(boxes), theirs(back);
  ours.step();
  theirs.step();
  EXPECT_LE((ours.vector("seen.x") - theirs.vector("seen.x")).norm(), kRoundOff);
  EXPECT_NEAR(ours.value("seen.y"), -2.0, kRoundOff);  // both fall alike
  written(finger("sensors:\n  - {name: seen, kind: position, link: tip, relative_to: middle}\n"));
  EXPECT_NE(exported_.text.find("reftype=\"site\" refname=\"seen/reference\""), std::string::npos);
  EXPECT_FALSE(lost("sensor", ""));
}

TEST_F(WrittenSensors, SensorPartsThatMjcfLacksAreNamed) {
  const Scene scene = finger(R"(
sensors:
  - {name: touch, kind: contact_force, link: tip}
  - {name: push, kind: momentum, link: tip}
  - {name: plate, kind: wrench, link: base}
  - {name: noisy, kind: imu, link: tip, noise: [0.1, 0.1]}
  - {name: near, kind: range, link: tip, limit: 3}
  - {name: press, kind: touch, link: tip}
)");
  const Scene back = written(scene);
  EXPECT_TRUE(lost("'touch'", "contact_force"));
  EXPECT_TRUE(lost("'push'", "linear_momentum"));
  EXPECT_TRUE(lost("'plate'", "force at a fixed joint"));
  EXPECT_TRUE(lost("'noisy'", "errors"));
  EXPECT_TRUE(lost("'near'", "largest distance"));
  EXPECT_TRUE(lost("'press'", "within a site"));
  EXPECT_EQ(back.model.sensors().size(), 4u);  // angular_momentum, two of the imu, range
}

}  // namespace
}  // namespace counterpoint::written_sensors_test
