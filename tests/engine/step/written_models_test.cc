// Scenes written as MJCF and read back have the same parts, and the same forces in a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/robot_files.h"
#include "engine/sensors/sensed.h"
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

const char* const kActuators = R"(
tendons:
  - name: cord
    path:
      - {point: [-0.006, 0, -0.02], link: base}
      - {point: [-0.006, 0, 0.02], link: proximal}
      - {point: [-0.006, 0, 0.015], link: middle}
  - {name: sum, joints: {knuckle: 0.01, tip_joint: 0.02}}
actuators:
  - {name: lagged, joint: knuckle, gear: 2, position: {stiffness: 0.5, damping: 0.01}, lag: 0.02,
     range: [-1, 1], force_limits: [-0.3, 0.4], command: 0.8}
  - {name: biased, tendon: sum, gain: 3, bias: 0.5, lag: 0.01, command: 0.4, gear: -1.5}
  - {name: motor, joint: tip_joint, gear: 3, command: 4, lag: 0.001,
     dc_motor: {torque_constant: 0.01, resistance: 2, current_limit: 1.5}}
  - {name: jet, link: tip, point: [0, 0.01, 0.02], force: [1, 0.5, 0.2], torque: [0.01, 0, 0.02],
     gear: 0.5, range: [0, 3], command: 0.7}
  - {name: pull, tendon: cord, command: 0.6, muscle: {curves: mujoco, max_force: 30,
     optimal_length: 0.06, slack_length: 0.01, max_speed: 8, shortest: 0.4, longest: 1.7,
     passive_force: 1.1, eccentric_force: 1.4, activation_time: 0.02, deactivation_time: 0.05}}
  - {name: bend, joint: knuckle, gear: 0.05, command: 0.3, muscle: {curves: mujoco, max_force: 5,
     optimal_length: 0.05, slack_length: -0.03}}
)";

void expect_same_actuator(const Actuator& a, const Actuator& b) {
  EXPECT_EQ(a.transmission, b.transmission) << a.name;
  EXPECT_EQ(a.joint, b.joint);
  EXPECT_EQ(a.tendon, b.tendon);
  EXPECT_EQ(a.body, b.body);
  EXPECT_LE((a.point - b.point).norm(), kRoundOff);
  EXPECT_LE((a.gear * a.direction.force - b.gear * b.direction.force).norm(), kRoundOff);
  EXPECT_LE((a.gear * a.direction.torque - b.gear * b.direction.torque).norm(), kRoundOff);
  EXPECT_EQ(a.lag, b.lag);
  EXPECT_EQ(a.command, b.command);
  EXPECT_EQ(std::pair(a.least_command, a.most_command), std::pair(b.least_command, b.most_command));
  if (a.law == b.law && a.law == ActuatorLaw::kAffine) {
    EXPECT_EQ(std::pair(a.gain, a.bias), std::pair(b.gain, b.bias)) << a.name;
    EXPECT_EQ(std::pair(a.stiffness, a.damping), std::pair(b.stiffness, b.damping));
    EXPECT_EQ(std::pair(a.least, a.most), std::pair(b.least, b.most));
  }
  if (a.law != ActuatorLaw::kMuscle) return;
  const Muscle &m = a.muscle, &n = b.muscle;
  EXPECT_EQ(m.curves, n.curves);
  EXPECT_NEAR(m.optimal_length, n.optimal_length, kRoundOff);
  EXPECT_NEAR(m.slack_length, n.slack_length, kRoundOff);
  EXPECT_EQ(std::pair(m.max_force, m.max_speed), std::pair(n.max_force, n.max_speed));
  EXPECT_EQ(std::pair(m.shortest, m.longest), std::pair(n.shortest, n.longest));
  EXPECT_EQ(m.passive_force, n.passive_force);
  EXPECT_EQ(m.eccentric_force, n.eccentric_force);
  EXPECT_EQ(std::pair(m.activation_time, m.deactivation_time),
            std::pair(n.activation_time, n.deactivation_time));
}

TEST_F(WrittenModels, ActuatorsHaveTheSameLawsAndForces) {
  const Scene scene = finger(kActuators);
  const Scene back = written(scene);
  ASSERT_EQ(back.model.actuators().size(), scene.model.actuators().size());
  for (std::size_t i = 0; i < scene.model.actuators().size(); ++i)
    expect_same_actuator(scene.model.actuators()[i], back.model.actuators()[i]);
  expect_same_step(scene, back);
  EXPECT_FALSE(lost("actuator", ""));
}

/// An affine actuator without lag is read as a servo of its joint, with the same force at the
/// command of the start. A servo counts in the prediction of Coriolis forces, a row does not: they
/// are taken at the start of the step.
TEST_F(WrittenModels, PlainActuatorsAreReadAsServos) {
  Scene scene = finger(R"(
actuators:
  - {name: hold, joint: knuckle, gear: 2, position: {stiffness: 0.5, damping: 0.01}, command: 0.8}
  - {name: motor, joint: tip_joint, gear: 3, command: 4,
     dc_motor: {torque_constant: 0.01, resistance: 2, current_limit: 3}}
)");
  Scene back = written(scene);
  scene.options.mean_velocity_forces = back.options.mean_velocity_forces = false;
  EXPECT_TRUE(back.model.actuators().empty());
  EXPECT_EQ(back.model.servos().size(), 2u);
  expect_same_step(scene, back);
}

/// The limit of a joint bounds its servo, not the actuators beside it.
TEST_F(WrittenModels, EffortLimitsBoundServosOnly) {
  const Scene scene = load_scene(folder_.write(
      "scene.yaml", "models:\n  - {urdf: " + test::source_dir() +
                        "/data/robots/finger.urdf, dynamics: {knuckle: {effort_limit: 0.1, servo: "
                        "{stiffness: 4, damping: 0.01, position: 1}}, tip_joint: {effort_limit: "
                        "0.01}}}\nactuators:\n  - {name: strong, joint: tip_joint, lag: 0.01, "
                        "command: 0.2}\n"));
  const Scene back = written(scene);
  EXPECT_EQ(back.model.joint(back.model.find_joint("knuckle")).effort_limit, 0.1);
  expect_same_step(scene, back);
  EXPECT_EQ(exported_.text.find("actuatorfrcrange"), std::string::npos);
}

TEST_F(WrittenModels, AdhesionPullsAtTheSameContacts) {
  const Scene scene = load_scene(folder_.write("scene.yaml", R"(
ground: {friction: 0.5}
models:
  - {name: cup, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.05]}
actuators:
  - {name: hold, link: cup/body, adhesion: {reach: 0}, gain: 2, gear: 3, range: [0, 5], command: 4}
)"));
  const Scene back = written(scene);
  ASSERT_EQ(back.model.actuators().size(), 1u);
  EXPECT_EQ(back.model.actuators()[0].most_command, 5.0);
  Simulator ours(scene), theirs(back);
  ASSERT_TRUE(ours.step().succeeded() && theirs.step().succeeded());
  const auto pull = [](Simulator& sim) {
    Vector3 sum = Vector3::Zero();
    for (const ExternalWrench& w : sim.last_forces().actuator_wrenches) sum += w.wrench.force;
    return sum;
  };
  EXPECT_NEAR(pull(ours).z(), -2.0 * 3.0 * 4.0, kRoundOff);
  EXPECT_LE((pull(ours) - pull(theirs)).norm(), kRoundOff);
}

TEST_F(WrittenModels, ActuatorsThatMjcfLacksAreNamed) {
  const Scene scene = finger(R"(
actuators:
  - {name: pid, joint: knuckle, pid: {kp: 20, ki: 5}}
  - {name: coil, joint: knuckle, dc_motor: {torque_constant: 0.01, resistance: 2, inductance: 0.1}}
  - {name: rotor, link: tip, propeller: {joint: knuckle, thrust: 1.0e-5, drag: 0}}
  - {name: fibre, joint: knuckle, muscle: {max_force: 5, optimal_length: 0.1}}
  - {name: late, joint: tip_joint, gain: 2, delay: 0.01, slew: 3, lag: 0.1}
)");
  const Scene back = written(scene);
  EXPECT_TRUE(lost("'pid'", "PID"));
  EXPECT_TRUE(lost("'coil'", "inductance"));
  EXPECT_TRUE(lost("'rotor'", "propeller"));
  EXPECT_TRUE(lost("'fibre'", "Millard"));
  EXPECT_TRUE(lost("'late'", "delay"));
  EXPECT_TRUE(lost("'late'", "slew"));
  ASSERT_EQ(back.model.actuators().size(), 1u);
  EXPECT_EQ(back.model.actuators()[0].lag, 0.1);
}

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

TEST_F(WrittenModels, SensorsHaveTheSameReadings) {
  const Scene scene = finger(kSensors);
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

/// The frame of a body is its link's where the joint is free; else a site has the link's axes.
TEST_F(WrittenModels, ReferencesAreBodiesOrSites) {
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

TEST_F(WrittenModels, SensorPartsThatMjcfLacksAreNamed) {
  const Scene scene = finger(R"(
sensors:
  - {name: touch, kind: contact_force, link: tip}
  - {name: push, kind: momentum, link: tip}
  - {name: plate, kind: wrench, link: base}
  - {name: noisy, kind: imu, link: tip, noise: [0.1, 0.1]}
  - {name: near, kind: range, link: tip, limit: 3}
)");
  const Scene back = written(scene);
  EXPECT_TRUE(lost("'touch'", "contact_force"));
  EXPECT_TRUE(lost("'push'", "linear_momentum"));
  EXPECT_TRUE(lost("'plate'", "force at a fixed joint"));
  EXPECT_TRUE(lost("'noisy'", "errors"));
  EXPECT_TRUE(lost("'near'", "largest distance"));
  EXPECT_EQ(back.model.sensors().size(), 4u);  // angular_momentum, two of the imu, range
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
