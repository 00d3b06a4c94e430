// Wrenches through joints and welds: weights by hand, Newton's law for a payload, and the forces of
// joints that the inverse recovers.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/sensors/sensed.h"
#include "support/arm_spec.h"
#include "support/random_model.h"

namespace counterpoint::sensor_wrench_test {
namespace {

using test::imu;
using test::make_joint;
using test::make_link;
using test::Sensed;
using test::sensor;
using test::wrench;

constexpr double kGravity = 9.81;  // [m/s^2]
/// The inverse agrees with the step to this part of the largest force.
constexpr double kInverse = 1e-9;

/// A fixed column (3 kg), an arm (1 kg) turning about y, a tool (0.2 kg) welded to the arm's end,
/// and a payload (2 kg) welded to the tool.
RobotSpec arm_with_payload() {
  RobotSpec robot;
  robot.name = "arm";
  robot.links = {make_link("column", 3.0), make_link("arm", 1.0, 0.02),
                 make_link("tool", 0.2, 1e-3), make_link("payload", 2.0, 0.01)};
  robot.links[3].inertia.center = {0, 0, -0.1};
  robot.joints = {make_joint("shoulder", "column", "arm"), make_joint("flange", "arm", "tool"),
                  make_joint("grip", "tool", "payload")};
  robot.joints[0].axis = Vector3::UnitY();
  robot.joints[1].fixed = robot.joints[2].fixed = true;
  robot.joints[1].X_PJ = {rotation_from_rpy(0.3, 0, 0), Vector3(0, 0, -0.5)};
  robot.joints[2].X_PJ.translation = {0.05, 0, 0};
  return robot;
}

Scene arm_scene(const std::vector<SensorSpec>& sensors) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(arm_with_payload(), Base::kFixed, Pose());
  for (const SensorSpec& one : sensors) builder.add_sensor(one);
  Scene scene = scene_of(builder.build());
  return scene;
}

TEST(SensorWrench, AColumnOnAForcePlateWeighsTheWholeArm) {
  Sensed run(arm_scene({wrench("plate", "column"), wrench("tool", "tool")}));
  run.step();  // the arm hangs at rest, but not in balance: its payload is off the axis
  const double a = run.simulator.state().v[0] / run.simulator.options().time_step;
  EXPECT_NEAR(run.value("tool.fx"), 0.0, 5.0 * std::abs(a));
  // Held by the torque of the shoulder the arm does not move, and the plate carries 6.2 kg.
  const Inverse& hold = run.simulator.inverse(run.before.q, run.before.v, run.before.v);
  run.simulator.input().applied_force = hold.applied_force;
  run.simulator.reset();
  run.step();
  const Vector3 weight(0, 0, 6.2 * kGravity);
  EXPECT_LE((run.vector("plate.fx") - weight).norm(), kInverse * weight.norm());
  // The moment about the column's origin is that of the joint, and across it that of the payload,
  // whose centre is 0.1 m below its tool, which leans by 0.3 rad.
  const Vector3 moment(2.0 * kGravity * 0.1 * std::sin(0.3), hold.applied_force[0], 0.0);
  EXPECT_LE((run.vector("plate.tx") - moment).norm(), kInverse * weight.norm());
}

TEST(SensorWrench, AWeldCarriesMassTimesAccelerationOfThePayload) {
  const Vector3 center(0, 0, -0.1);
  SensorSpec at_center = wrench("grip", "payload", center);
  at_center.sensor.X_FS.rotation = rotation_from_rpy(0.4, -0.2, 0.9);
  SensorSpec meter = imu("imu", "payload", center);
  meter.sensor.X_FS = at_center.sensor.X_FS;
  SensorSpec turning = sensor("turning", {SensorKind::kAngularAcceleration}, "payload", center);
  turning.sensor.X_FS = at_center.sensor.X_FS;
  turning.sensor.own_axes = true;
  Scene scene = arm_scene({at_center, meter, turning});
  scene.q[0] = 1.2;
  scene.v[0] = 3.0;
  Sensed run(std::move(scene));
  for (int i = 0; i < 100; ++i) {
    run.step();
    const Vector3 force = 2.0 * run.vector("imu.ax");
    EXPECT_LE((run.vector("grip.fx") - force).norm(), kInverse * force.norm()) << i;
    // The payload is a ball, with no gyroscopic torque: torque about its centre is I alpha.
    const Vector3 torque = 0.01 * run.vector("turning.dwx");
    EXPECT_LE((run.vector("grip.tx") - torque).norm(), kInverse * force.norm()) << i;
  }
}

TEST(SensorWrench, ForcesAppliedBeyondAWeldPassThroughIt) {
  Sensed run(
      arm_scene({wrench("grip", "payload"), wrench("flange", "tool"), imu("imu", "payload")}));
  ExternalWrench push;
  push.body = 1;
  push.wrench = {Vector3(0.1, 0.2, 0.3), Vector3(5, -3, 7)};
  push.frame = run.simulator.model().find_frame("payload");
  push.point =
      run.simulator.model().frames()[static_cast<std::size_t>(push.frame)].X_BF.translation;
  const auto difference = [&](const char* link) {
    run.simulator.reset();
    run.simulator.input().wrenches.clear();
    run.step();
    const Vector3 without = run.vector("grip.fx"), flange = run.vector("flange.fx");
    push.frame = run.simulator.model().find_frame(link);
    // The motion is kept: what changes is the part that the applied force carries.
    run.simulator.input().wrenches = {push};
    const Inverse& inverse =
        run.simulator.inverse(run.before.q, run.before.v, run.simulator.state().v);
    EXPECT_FALSE(inverse.fault.any());
    const State after = run.simulator.state();
    run.table.evaluate({run.before.q, run.before.v, after.q, after.v, run.simulator.input(),
                        run.simulator.options().time_step},
                       run.values);
    return std::pair<Vector3, Vector3>(run.vector("grip.fx") - without,
                                       run.vector("flange.fx") - flange);
  };
  const Matrix3 to_sensor = rotation_from_rpy(0.3, 0, 0).transpose();
  const Vector3 expected = -(to_sensor * push.wrench.force);
  const double tolerance = kInverse * 30.0;  // [N]
  const auto [grip, flange] = difference("payload");
  EXPECT_LE((grip - expected).norm(), tolerance);
  EXPECT_LE((flange - expected).norm(), tolerance);
  const auto [grip_2, flange_2] = difference("tool");
  EXPECT_LE(grip_2.norm(), tolerance);
  EXPECT_LE((flange_2 - expected).norm(), tolerance);
  const auto [grip_3, flange_3] = difference("arm");
  EXPECT_LE(grip_3.norm(), tolerance);
  EXPECT_LE(flange_3.norm(), tolerance);
}

/// Power of a wrench on a link along the motion of its joint's coordinate k: for a joint without
/// damping, spring and armature the force in the coordinate.
VectorX joint_force(const Model& model, const VectorX& q, int body, const Sensed& run,
                    const std::string& name) {
  const Body& b = model.body(body);
  const std::vector<Pose> X_WB = body_poses(model, q);
  const Pose X_WJ = X_WB[static_cast<std::size_t>(b.parent)] * b.X_PJ;
  const Frame& link =
      model.frames()[static_cast<std::size_t>(model.find_frame(model.joint(body - 1).link))];
  const Pose X_WF = X_WB[static_cast<std::size_t>(body)] * link.X_BF;
  const Vector3 force = X_WF.rotation * run.vector(name + ".fx");
  const Vector3 torque =
      X_WF.rotation * run.vector(name + ".tx") +
      (X_WF.translation - X_WB[static_cast<std::size_t>(body)].translation).cross(force);
  const Matrix3& R_WB = X_WB[static_cast<std::size_t>(body)].rotation;
  VectorX out(joint_nv(b.joint_type));
  switch (b.joint_type) {
    case JointType::kRevolute:
      out << X_WJ.rotation.col(2).dot(torque);
      break;
    case JointType::kPrismatic:
      out << X_WJ.rotation.col(2).dot(force);
      break;
    case JointType::kPlanar:
      out << X_WJ.rotation.col(0).dot(force), X_WJ.rotation.col(1).dot(force),
          X_WJ.rotation.col(2).dot(torque);
      break;
    case JointType::kSpherical:
      out << R_WB.transpose() * torque;
      break;
    case JointType::kFloating:
      out << X_WJ.rotation.transpose() * force, R_WB.transpose() * torque;
      break;
  }
  return out;
}

TEST(SensorWrench, AlongAJointItIsTheForceThatTheInverseRecovers) {
  for (int seed = 0; seed < 16; ++seed) {
    test::RandomModelOptions options = test::varied_options(seed);
    options.robots = 1;
    options.closures = seed % 4 == 0 ? 1 : 0;
    const auto key = static_cast<std::uint64_t>(seed);
    const RobotSpec robot = test::make_random_robot(key, options);
    ModelBuilder builder;
    builder.add_robot(robot, options.base, Pose());
    for (int j = 0; j < builder.num_joints(); ++j) {
      SensorSpec one = wrench("w" + std::to_string(j), "");
      one.joint = builder.joint_name(j);
      builder.add_sensor(one);
    }
    builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
    Scene scene = scene_of(builder.build());
    scene.q = test::random_configuration(scene.model, key);
    scene.v = test::random_vector(scene.model.nv(), key);
    Sensed run(std::move(scene));
    const Model& model = run.simulator.model();
    run.simulator.input().applied_force = test::random_vector(model.nv(), key, 5.0);
    ExternalWrench push;
    push.body = model.num_bodies() - 1;
    push.wrench.force = {3, 2, 1};
    if (push.body > 0) run.simulator.input().wrenches = {push};
    for (int i = 0; i < 30; ++i) {
      run.step();
      const Inverse inverse =
          run.simulator.inverse(run.before.q, run.before.v, run.simulator.state().v);
      for (int b = 1; b < model.num_bodies(); ++b) {
        const VectorX force = joint_force(model, run.before.q, b, run, "w" + std::to_string(b - 1));
        const VectorX expected = inverse.applied_force.segment(model.body(b).v_index, force.size());
        EXPECT_LE((force - expected).norm(), kInverse * (1.0 + inverse.force_scale))
            << seed << " step " << i << " joint " << b - 1;
      }
    }
  }
}

/// A thruster on the payload that carries it takes its weight off the weld, and off the joint.
TEST(SensorWrench, AThrusterTakesItsForceOffTheWeld) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(arm_with_payload(), Base::kFixed, Pose());
  ActuatorSpec jet;
  jet.link = "payload";
  jet.actuator.name = "jet";
  jet.actuator.transmission = Transmission::kLink;
  jet.actuator.point = {0, 0, -0.1};  // its centre of mass
  jet.actuator.direction.force = rotation_from_rpy(0.3, 0, 0).transpose() * Vector3::UnitZ();
  builder.add_actuator(jet);
  for (const SensorSpec& one : {wrench("grip", "payload"), imu("imu", "payload", {0, 0, -0.1})})
    builder.add_sensor(one);
  Sensed run(scene_of(builder.build()));
  for (const double thrust : {0.0, 2.0 * kGravity, -7.0}) {
    run.simulator.reset();
    run.simulator.input().command = VectorX::Constant(1, thrust);
    run.simulator.input().z = run.simulator.state().z;
    run.step();
    const Vector3 force = 2.0 * run.vector("imu.ax") - thrust * jet.actuator.direction.force;
    EXPECT_LE((run.vector("grip.fx") - force).norm(), kInverse * 2.0 * kGravity) << thrust;
  }
}

TEST(SensorWrench, AboveAMasslessLinkJointAndWeldCarryTheSame) {
  // The foot is welded to a massless link that the joint moves; it stands on the ground.
  RobotSpec robot = test::make_arm();
  robot.links[1].inertia = {};
  robot.joints.pop_back();
  robot.links.pop_back();
  LinkSpec foot = make_link("foot", 2.0, 0.05);
  foot.collisions.push_back({"", Pose(), {ShapeType::kSphere, {0.1, 0, 0}, nullptr}, {}});
  robot.links.push_back(foot);
  robot.joints[0].axis = Vector3::UnitY();
  robot.joints.push_back(make_joint("ankle", "upper", "foot"));
  robot.joints[1].fixed = true;
  robot.joints[1].X_PJ.translation = {0.5, 0, 0};
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  Pose start;
  start.translation.z() = 0.11;
  builder.add_robot(robot, Base::kFixed, start);
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  builder.add_sensor(wrench("joint", "upper", {0.2, 0, 0}));
  builder.add_sensor(wrench("weld", "foot", {-0.3, 0, 0}));
  builder.add_sensor(sensor("ground", {SensorKind::kContactForce}, "foot"));
  Sensed run(scene_of(builder.build()));
  double largest = 0.0;
  for (int i = 0; i < 200; ++i) {
    run.step();
    const double scale = 2.0 * kGravity + run.vector("ground.fx").norm();
    largest = std::max(largest, run.vector("ground.fx").norm());
    EXPECT_LE((run.vector("joint.fx") - run.vector("weld.fx")).norm(), kInverse * scale) << i;
    EXPECT_LE((run.vector("joint.tx") - run.vector("weld.tx")).norm(), kInverse * scale) << i;
  }
  EXPECT_GT(largest, 5.0);  // the foot did touch
}

TEST(SensorWrench, WithoutAnInverseThereIsNoForce) {
  Scene scene = arm_scene({wrench("grip", "payload")});
  for (const Integrator integrator : {Integrator::kRungeKutta4, Integrator::kImplicitMidpoint}) {
    scene.options.integrator = integrator;
    EXPECT_THROW(SensorTable(scene.model, scene.options), InputError);
  }
}

TEST(SensorWrench, AWeldAmongLinksWithDragIsRefused) {
  RobotSpec robot = arm_with_payload();
  robot.links[1].drag.linear = 0.1;
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  EXPECT_NO_THROW(builder.add_sensor(wrench("shoulder", "arm")));
  EXPECT_THROW(builder.add_sensor(wrench("grip", "payload")), InputError);
}

}  // namespace
}  // namespace counterpoint::sensor_wrench_test
