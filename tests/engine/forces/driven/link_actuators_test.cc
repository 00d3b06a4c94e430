// Actuators on links: thrusters, propellers, adhesion.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "engine/forces/driven/wheel.h"
#include "support/recover.h"

namespace counterpoint::link_actuators_test {
namespace {

using test::kWheelInertia;
using test::named;
using test::wheel;

constexpr double kRoundoff = 1e-12;

Shape box_of(const Vector3& half) {
  Shape shape;
  shape.type = ShapeType::kBox;
  shape.size = half;
  return shape;
}

/// A free box of 2 kg with a thruster at its corner.
Scene rocket(const Actuator& thruster, const Vector3& gravity) {
  ModelBuilder builder(gravity);
  builder.add_robot(object_of("rocket", box_of({0.1, 0.2, 0.3}), 2.0), Base::kFloating, Pose(), "");
  builder.add_actuator({thruster, "", "", "body", ""});
  return scene_of(builder.build());
}

/// The force of a thruster turns with its link, and acts where it sits: after a quarter turn about
/// z its x force pushes along y, with the same torque in the body.
TEST(Actuators, ThrusterTurnsWithItsLink) {
  Actuator a = named("motor");
  a.transmission = Transmission::kLink;
  a.point = {0.0, 0.1, 0.0};
  a.direction = {Vector3(0, 0, 0.2), Vector3(1, 0, 0)};
  Scene scene = rocket(a, Vector3::Zero());
  scene.q.tail<4>() << std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5);
  const Matrix3 inertia = scene.model.body(1).inertia.rotational;
  Simulator sim(std::move(scene));
  sim.input().command = VectorX::Constant(1, 3.0);
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  const VectorX v = sim.state().v / 0.002;
  EXPECT_LT((v.head<3>() - Vector3(0, 3.0 / 2.0, 0)).norm(), kRoundoff);
  EXPECT_NEAR(v[5], (0.2 * 3.0 - 0.1 * 3.0) / inertia(2, 2), 1e-10);
  const Inverse& inverse = sim.last_forces();
  ASSERT_EQ(inverse.actuator_wrenches.size(), 1u);
  EXPECT_NEAR(inverse.actuator_wrenches[0].wrench.force.y(), 3.0, kRoundoff);
  EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1e-10);
}

/// Thrust of its weight holds a rocket still; the effects of the input may be off.
TEST(Actuators, ThrustOfItsWeightHoldsARocket) {
  Actuator a = named("motor");
  a.transmission = Transmission::kLink;
  a.direction.force = Vector3::UnitZ();
  a.command = 2.0 * kStandardGravity;
  Scene scene = rocket(a, {0, 0, -kStandardGravity});
  scene.options.effects.set(Effect::kExternalWrenches, false);
  Simulator sim(std::move(scene));
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_LT(sim.state().v.norm(), 1e-12);
  sim.options().effects.set(Effect::kActuators, false);
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[2], -0.002 * kStandardGravity, 1e-12);
}

/// A propeller on the wheel: thrust c w |w| along the axis does not turn the axle, drag slows it
/// like w' = -d w |w| / I, taken at the start of each step.
TEST(Actuators, PropellerDragSlowsItsJoint) {
  Actuator a = named("propeller");
  a.transmission = Transmission::kLink;
  a.law = ActuatorLaw::kPropeller;
  a.direction = {Vector3(0, 0, -1e-3), Vector3(0, 0, 2e-2)};
  Simulator sim(wheel(a));
  State start = sim.state();
  start.v[0] = -80.0;
  sim.set_state(start);
  double w = -80.0;
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_NEAR(sim.last_forces().actuator_force[0], w * std::abs(w), 1e-9 * w * w);
    w -= 0.002 * 1e-3 * w * std::abs(w) / kWheelInertia;
    EXPECT_NEAR(sim.state().v[0], w, 1e-10);
  }
}

/// A box under a plate that attracts it with F: it hangs where F > m g, and falls where F < m g.
TEST(Actuators, AdhesionHoldsUpToItsForce) {
  for (const double share : {0.999, 1.001}) {
    ModelBuilder builder;
    RobotSpec robot;
    robot.name = "gantry";
    LinkSpec base, cup;
    base.name = "base";
    cup.name = "cup";
    cup.inertia = solid_inertia(box_of({0.05, 0.05, 0.02}), 1.0);
    cup.collisions.push_back({"pad", Pose(), box_of({0.05, 0.05, 0.02}), {}});
    robot.links = {base, cup};
    JointSpec joint;
    joint.name = "lift";
    joint.type = JointType::kPrismatic;
    joint.parent = "base";
    joint.child = "cup";
    joint.axis = Vector3::UnitZ();
    joint.servo.stiffness = 1e5;
    joint.servo.damping = 1e3;
    joint.servo.position = 2.5 * kStandardGravity / 1e5;  // carries both from the start
    robot.joints = {joint};
    builder.add_robot(robot, Base::kFixed, {Matrix3::Identity(), Vector3(0, 0, 1)}, "gantry/");
    builder.add_robot(object_of("box", box_of({0.1, 0.1, 0.1}), 1.5), Base::kFloating,
                      {Matrix3::Identity(), Vector3(0, 0, 1.0 - 0.02 - 0.1)}, "box/");
    Actuator a = named("suction");
    a.transmission = Transmission::kAdhesion;
    a.reach = 1e-3;
    a.command = share * 1.5 * kStandardGravity;
    builder.add_actuator({a, "", "", "gantry/cup", ""});
    Scene scene = scene_of(builder.build());
    const int box = scene.model.find_frame("box/body");
    const int height = scene.model.body(scene.model.frames()[box].body).q_index + 2;
    Simulator sim(std::move(scene));
    const double start = sim.state().q[height] - sim.state().q[0];
    double error = 0.0;
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      const Inverse& inverse = sim.last_forces();
      error = std::max(error, inverse.applied_force.cwiseAbs().maxCoeff() / inverse.force_scale);
    }
    EXPECT_LT(error, test::kRecovered);
    const double fallen = start - (sim.state().q[height] - sim.state().q[0]);
    if (share > 1.0) {
      EXPECT_LT(std::abs(fallen), 1e-6);
    } else {
      EXPECT_GT(fallen, 1.0);  // free fall beyond the reach, for most of 2 s
    }
  }
}
}  // namespace
}  // namespace counterpoint::link_actuators_test
