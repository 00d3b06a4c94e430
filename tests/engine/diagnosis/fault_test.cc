// Faults of steps: tests provoke every kind and check that the right element is named.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"
#include "support/small_scenes.h"
#include "support/temp_folder.h"

namespace counterpoint::fault_test {
namespace {

using contact::Status;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// An arm of two revolute joints; arm_and_box() adds a servo at its elbow and a free box.
constexpr const char* kArm = R"(<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><mass value="1"/><origin xyz="0 0 -0.3"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/><origin xyz="0 0 -0.3"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="10"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 -0.6"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="0" velocity="10"/></joint>
</robot>)";

Scene arm_and_box(const std::string& more = "") {
  const test::TempFolder folder;
  folder.write("arm.urdf", kArm);
  return load_scene(
      folder.write("scene.yaml",
                   "ground: {}\nmodels:\n"
                   "  - {urdf: arm.urdf, name: arm, position: [0, 0, 3],\n"
                   "     dynamics: {elbow: {servo: {stiffness: 10, damping: 1}}}}\n"
                   "  - {name: box, box: [0.1, 0.1, 0.1], mass: 1, position: [2, 0, 0.1]}\n" +
                       more));
}

Scene read(const std::string& yaml) {
  const test::TempFolder folder;
  return load_scene(folder.write("scene.yaml", yaml));
}

/// Expects that the step fails with this status and leaves the state unchanged; returns the fault.
Fault expect_failure(Simulator& sim, Status status) {
  const State before = sim.state();
  const StepReport report = sim.step();
  EXPECT_EQ(report.status, status) << contact::status_name(report.status);
  EXPECT_FALSE(report.succeeded());
  EXPECT_TRUE(report.fault.any());
  EXPECT_EQ(sim.state().q, before.q);
  EXPECT_EQ(sim.state().v, before.v);
  EXPECT_EQ(sim.state().time, before.time);
  const FaultText text = describe(sim.model(), report.fault);
  EXPECT_NE(text.reason.find(text.element), std::string::npos) << text.reason;
  EXPECT_FALSE(text.advice.empty());
  return report.fault;
}

std::string element(const Simulator& sim, const Fault& fault) {
  return describe(sim.model(), fault).element;
}

TEST(Fault, NotANumberIsNamedInEveryCoordinate) {
  for (const char* more : {"", "effects: {contacts: off}\n"}) {
    Simulator sim(arm_and_box(more));
    const CoordinateNames names = coordinate_names(sim.model());
    const State start = sim.state();
    for (const double bad : {kNaN, kInfinity, -kInfinity}) {
      for (int k = 0; k < sim.model().nq(); ++k) {
        State state = start;
        state.q[k] = bad;
        Simulator broken(sim.scene());
        broken.set_state(state);
        const StepReport report = broken.step();
        ASSERT_EQ(report.status, Status::kNotFinite) << names.q[k];
        EXPECT_EQ(report.fault.kind, FaultKind::kPosition) << names.q[k];
        EXPECT_EQ(element(sim, report.fault), names.q[k]);
      }
      for (int k = 0; k < sim.model().nv(); ++k) {
        State state = start;
        state.v[k] = bad;
        sim.set_state(state);
        const StepReport report = sim.step();
        ASSERT_EQ(report.status, Status::kNotFinite) << names.v[k];
        EXPECT_EQ(report.fault.kind, FaultKind::kVelocity) << names.v[k];
        EXPECT_EQ(element(sim, report.fault), names.v[k]);
        sim.set_state(start);
        // The shoulder's effort limit would clamp an infinite force and hide it.
        sim.input().applied_force[k] = bad;
        const Fault fault = expect_failure(sim, Status::kNotFinite);
        EXPECT_EQ(fault.kind, FaultKind::kAppliedForce) << names.force[k];
        EXPECT_EQ(fault.coordinate, k);
        EXPECT_EQ(element(sim, fault), names.force[k]);
        sim.input().applied_force[k] = 0.0;
      }
    }
    EXPECT_TRUE(sim.step().succeeded());  // a fault leaves nothing behind
  }
}

TEST(Fault, LargestAndSmallestNumbersAreNumbers) {
  Simulator sim(test::slider({}));
  for (const double force :
       {-0.0, std::numeric_limits<double>::denorm_min(), -std::numeric_limits<double>::min()}) {
    sim.input().applied_force[0] = force;
    EXPECT_TRUE(sim.step().succeeded()) << force;
  }
  sim.options().max_speed = kInfinity;
  sim.input().applied_force[0] = std::numeric_limits<double>::max();  // times 2 ms over 1 kg
  EXPECT_TRUE(sim.step().succeeded());
}

TEST(Fault, WrenchesAndTargetsAreNamed) {
  Simulator sim(arm_and_box());
  const int box = sim.model().num_bodies() - 1;
  for (int part = 0; part < 9; ++part) {
    ExternalWrench wrench;
    wrench.body = box;
    Vector3& vector = part < 3   ? wrench.wrench.force
                      : part < 6 ? wrench.wrench.torque
                                 : wrench.point;
    vector[part % 3] = part < 6 ? kNaN : kInfinity;
    wrench.wrench.force.x() += 1.0;
    sim.input().wrenches = {ExternalWrench{1, {}}, wrench};
    const Fault fault = expect_failure(sim, Status::kNotFinite);
    EXPECT_EQ(fault.kind, FaultKind::kWrench) << part;
    EXPECT_EQ(fault.index, 1);
    EXPECT_EQ(fault.body, box);
    EXPECT_EQ(element(sim, fault), "box/body");
  }
  sim.input().wrenches.clear();
  for (const double bad : {kNaN, kInfinity}) {
    sim.input().servo_position = VectorX::Constant(1, bad);
    EXPECT_EQ(expect_failure(sim, Status::kNotFinite).kind, FaultKind::kServoPosition);
    sim.input().servo_position = VectorX();
    sim.input().servo_velocity = VectorX::Constant(1, bad);
    const Fault fault = expect_failure(sim, Status::kNotFinite);
    EXPECT_EQ(fault.kind, FaultKind::kServoVelocity);
    EXPECT_EQ(element(sim, fault), "arm/elbow.target_velocity");
    sim.input().servo_velocity = VectorX();
  }
}

TEST(Fault, TheTimeIsLookedAt) {
  Simulator sim(test::slider({}));
  State state = sim.state();
  state.time = kNaN;
  sim.set_state(state);
  const StepReport report = sim.step();
  EXPECT_EQ(report.status, Status::kNotFinite);
  EXPECT_EQ(report.fault.kind, FaultKind::kTime);
  EXPECT_EQ(describe(sim.model(), report.fault).reason, "the time is nan");
}

TEST(Fault, QuaternionsMustBeOfUnitLength) {
  for (const double length : {1.0 + 3e-6, 1.0 - 3e-6, 2.0, 0.0}) {
    Simulator sim(test::box_on_plane({}));
    State state = sim.state();
    state.q.tail<4>() *= length;
    sim.set_state(state);
    const Fault fault = expect_failure(sim, Status::kInvalidState);
    EXPECT_EQ(fault.kind, FaultKind::kQuaternion);
    EXPECT_NEAR(fault.value, length, 1e-15);  // rounding of a square root
    EXPECT_EQ(element(sim, fault), "box");
    state.q.tail<4>() = Eigen::Vector4d(0.5, -0.5, 0.5, -0.5) * (1.0 + 3e-7);
    sim.set_state(state);
    EXPECT_TRUE(sim.step().succeeded());
  }
}

TEST(Fault, WrongSizesAreRefused) {
  Scene scene = arm_and_box();
  Workspace workspace(scene.model);
  const State state{0.0, scene.q, scene.v};
  State next;
  const auto step = [&](const State& from, const Input& input) {
    return step_forward(scene.model, scene.options, {}, from, input, workspace, next);
  };
  State longer = state;
  longer.q = VectorX::Zero(scene.model.nq() + 1);
  EXPECT_THROW(step(longer, {}), InputError);
  longer = state;
  longer.v = VectorX::Zero(1);
  EXPECT_THROW(step(longer, {}), InputError);
  EXPECT_THROW(step(state, {VectorX::Zero(3), {}}), InputError);
  EXPECT_THROW(step(state, {VectorX(), {ExternalWrench{99, {}}}}), InputError);
  EXPECT_THROW(step(state, {VectorX(), {}, VectorX::Zero(2), {}}), InputError);
  EXPECT_TRUE(step(state, {}).succeeded());
  for (const double h : {0.0, -0.001, kNaN, kInfinity}) {
    scene.options.time_step = h;
    EXPECT_THROW(step(state, {}), InputError) << h;
  }
}

/// A massless boom turns about z, and a point mass slides on it. With the mass on the axis nothing
/// resists the rotation.
TEST(Fault, AJointThatMovesNoInertiaIsNamed) {
  RobotSpec robot;
  robot.name = "boom";
  LinkSpec base, boom, weight;
  base.name = "base";
  boom.name = "boom";
  weight.name = "weight";
  weight.inertia = {1.0, Vector3::Zero(), Matrix3::Zero()};
  robot.links = {base, boom, weight};
  JointSpec turn;
  turn.name = "turn";
  turn.parent = "base";
  turn.child = "boom";
  turn.axis = Vector3::UnitZ();
  JointSpec slide;
  slide.name = "slide";
  slide.type = JointType::kPrismatic;
  slide.parent = "boom";
  slide.child = "weight";
  slide.axis = Vector3::UnitX();
  slide.X_PJ.translation.x() = 1.0;
  robot.joints = {turn, slide};
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  Model model = builder.build();
  Simulator sim(Scene{"boom", model, model.default_q(), VectorX::Zero(2), {}});
  EXPECT_TRUE(sim.step().succeeded());
  State state = sim.state();
  state.q[1] = -1.0;
  sim.set_state(state);
  const Fault fault = expect_failure(sim, Status::kSingular);
  EXPECT_EQ(fault.kind, FaultKind::kSingularInertia);
  EXPECT_EQ(element(sim, fault), "turn");
  EXPECT_EQ(fault.value, 0.0);
}

/// A tilted box is thrown at the ground; elsewhere a ball drops on it from 5 mm.
TEST(Fault, TheContactThatWasNotSolvedIsNamed) {
  Scene scene = read(
      "ground: {friction: 0.5}\n"
      "models:\n"
      "  - {name: calm, sphere: 0.1, mass: 1, position: [5, 0, 0.105]}\n"
      "  - {name: thrown, box: [0.1, 0.2, 0.3], mass: 1, position: [0, 0, 0.36], rpy: [0.3, 0.4, "
      "0],\n"
      "     velocity: {linear: [3, 1, -20], angular: [4, 5, 6]}}\n");
  Simulator sim(scene);
  sim.settings().max_iterations = 0;
  sim.settings().soften_after = 0;
  StepReport report = sim.step();
  for (int k = 0; k < 20 && report.succeeded(); ++k) report = sim.step();
  ASSERT_EQ(report.status, Status::kMaxIterations);
  EXPECT_EQ(report.fault.kind, FaultKind::kUnsolved);
  EXPECT_EQ(report.fault.constraint, ConstraintKind::kContact);
  EXPECT_EQ(element(sim, report.fault), "thrown/body/shape - ground");
  EXPECT_GT(report.fault.value, 1e-6);  // [m/s]: far from solved
  const FaultText text = describe(sim.model(), report.fault);
  EXPECT_NE(text.reason.find("contact 'thrown/body/shape - ground'"), std::string::npos)
      << text.reason;
}

/// Without iterations every constraint stays unsolved and must be named.
TEST(Fault, EveryKindOfConstraintIsNamed) {
  const test::TempFolder folder;
  folder.write("arm.urdf", kArm);
  const auto first_fault = [&](const std::string& model, const std::string& rest) {
    Simulator sim(load_scene(folder.write(
        "scene.yaml", "models:\n  - {urdf: arm.urdf, name: arm" + model + "}\n" + rest)));
    sim.settings().max_iterations = 0;
    sim.settings().soften_after = 0;
    const StepReport report = sim.step();
    EXPECT_EQ(report.status, Status::kMaxIterations) << rest;
    const FaultText text = describe(sim.model(), report.fault);
    EXPECT_FALSE(text.advice.empty());
    return text.reason.substr(0, text.reason.rfind(','));
  };
  EXPECT_EQ(first_fault(", joints: {elbow: 2.05}, joint_velocities: {elbow: 3}", ""),
            "not solved, worst at limit of joint 'arm/elbow'");
  EXPECT_EQ(first_fault(", joints: {elbow: 1}, dynamics: {elbow: {dry_friction: 0.1}}", ""),
            "not solved, worst at dry friction or motor of joint 'arm/elbow'");
  EXPECT_EQ(first_fault(", joint_velocities: {elbow: 3}",
                        "closures:\n  - {name: hook, type: ball, between: [world, arm/lower], "
                        "anchor_a: [0.3, 0, -0.6]}\n"),
            "not solved, worst at closure 'hook'");
}

TEST(Fault, AConstraintThatCannotBePosedIsNamed) {
  for (const double compliance : {kNaN, -1e-6, 0.0, kInfinity}) {
    Simulator sim(test::box_on_plane({}));
    sim.options().contact.compliance = compliance;
    const StepReport report = sim.step();
    EXPECT_FALSE(report.succeeded());
    EXPECT_EQ(report.fault.kind, FaultKind::kConstraint) << compliance;
    EXPECT_EQ(element(sim, report.fault), "box/0 - ground");
  }
}

TEST(Fault, TheInverseNamesWhatItWasGiven) {
  Simulator sim(arm_and_box());
  const State state = sim.state();
  const CoordinateNames names = coordinate_names(sim.model());
  EXPECT_FALSE(sim.inverse(state.q, state.v, state.v).fault.any());
  for (int k = 0; k < sim.model().nv(); ++k) {
    VectorX v = state.v;
    v[k] = kNaN;
    const Inverse& before = sim.inverse(state.q, v, state.v);
    EXPECT_EQ(before.fault.kind, FaultKind::kVelocity);
    EXPECT_EQ(before.fault.coordinate, k);
    EXPECT_TRUE(before.applied_force.array().isNaN().all());
    const Inverse& after = sim.inverse(state.q, state.v, v);
    EXPECT_EQ(after.fault.kind, FaultKind::kNewVelocity);
    EXPECT_EQ(element(sim, after.fault), names.v[k]);
  }
  VectorX q = state.q;
  q[0] = kInfinity;
  EXPECT_EQ(sim.inverse(q, state.v, state.v).fault.kind, FaultKind::kPosition);
  q = state.q;
  q.tail<4>() *= 1.1;
  EXPECT_EQ(sim.inverse(q, state.v, state.v).fault.kind, FaultKind::kQuaternion);
  VectorX fast = state.v;
  fast[0] = 1e308;  // over 2 ms: the acceleration overflows
  EXPECT_EQ(sim.inverse(state.q, state.v, fast).fault.kind, FaultKind::kRecoveredForce);
  EXPECT_FALSE(sim.inverse(state.q, state.v, state.v).fault.any());
}

}  // namespace
}  // namespace counterpoint::fault_test
