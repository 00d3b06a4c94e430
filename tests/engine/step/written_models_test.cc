// Scenes written as MJCF and read back have the same parts, and the same forces in a step.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "engine/step/written.h"

namespace counterpoint::written_models_test {
namespace {

using test::kRoundOff;
using test::WrittenModels;

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
  - {name: creep, joint: tip_joint, position: {stiffness: 0.5}, integrate: [0.1, 1], command: 0.2}
  - {name: brake, joint: knuckle, damper: {damping: 0.1}, range: [0, 2], command: 0.4}
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
  EXPECT_EQ(a.integrates, b.integrates);
  EXPECT_EQ(a.least_setpoint, b.least_setpoint);
  EXPECT_EQ(a.command_damping, b.command_damping);
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
