// Actuators against closed forms of the discrete scheme, and their inverse.
#include "counterpoint/engine/forces/actuators.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/special_values.h"
#include "support/linkages.h"
#include "support/random_model.h"
#include "support/recover.h"
#include "support/temp_folder.h"

namespace counterpoint::actuators_test {
namespace {

constexpr double kRoundoff = 1e-12;
constexpr double kInertia = 0.5;  // of the wheel about its axis [kg m^2]

Shape box_of(const Vector3& half) {
  Shape shape;
  shape.type = ShapeType::kBox;
  shape.size = half;
  return shape;
}

Actuator named(const std::string& name) {
  Actuator a;
  a.name = name;
  return a;
}

/// A wheel on a revolute joint "axle" about the world's z axis, driven by an actuator "motor";
/// steps of 2 ms, without gravity.
Scene wheel(const Actuator& actuator, double upper = kInfinity) {
  RobotSpec robot;
  robot.name = "robot";
  LinkSpec base, disk;
  base.name = "base";
  disk.name = "disk";
  disk.inertia.mass = 1.0;
  disk.inertia.rotational = kInertia * Matrix3::Identity();
  robot.links = {base, disk};
  JointSpec joint;
  joint.name = "axle";
  joint.parent = "base";
  joint.child = "disk";
  joint.axis = Vector3::UnitZ();
  joint.upper = upper;
  robot.joints = {joint};
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFixed, Pose());
  builder.add_actuator({actuator, "axle", "", "", ""});
  return scene_of(builder.build());
}

/// Steps with a command, and calls look(inverse of the step, speed after it) after each.
void run(Simulator& sim, int steps, double command,
         const std::function<void(const Inverse&, double)>& look) {
  sim.settings().tolerance = 1e-14;
  sim.input().command = VectorX::Constant(1, command);
  for (int i = 0; i < steps; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse inverse = sim.last_forces();
    ASSERT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_LT((inverse.z_next - sim.state().z).norm(), 1e-12);
    look(inverse, sim.state().v[0]);
  }
}

/// A force of gain u + bias at gear g accelerates by g (gain u + bias) / I; the force reported is
/// the actuator's own.
TEST(Actuators, ForceActsThroughItsGear) {
  Actuator a = named("motor");
  a.gain = 3.0;
  a.bias = 0.5;
  a.gear = -4.0;
  a.most_command = 2.0;
  Simulator sim(wheel(a));
  double speed = 0.0;
  run(sim, 50, 5.0, [&](const Inverse& inverse, double v) {
    speed += 0.002 * -4.0 * (3.0 * 2.0 + 0.5) / kInertia;  // the command ends at its bound
    EXPECT_NEAR(v, speed, kRoundoff * std::abs(speed));
    EXPECT_NEAR(inverse.actuator_force[0], 6.5, 1e-10);
  });
}

/// Voltage u: backward Euler of I dw/dt = N K i, L di/dt + R i = u - K N w, as a linear system of
/// two unknowns.
TEST(Actuators, DcMotorFollowsItsTwoEquations) {
  for (const double inductance : {0.0, 0.02}) {
    Actuator a = named("motor");
    a.law = ActuatorLaw::kDcMotor;
    a.torque_constant = 0.3;
    a.resistance = 1.5;
    a.inductance = inductance;
    a.gear = 5.0;
    Simulator sim(wheel(a));
    const double h = 0.002, K = a.gear * a.torque_constant;
    double w = 0.0, i = 0.0;
    run(sim, 3000, 12.0, [&](const Inverse& inverse, double v) {
      Eigen::Matrix2d A;
      A << kInertia / h, -K, K, a.resistance + inductance / h;
      const Eigen::Vector2d next =
          A.lu().solve(Eigen::Vector2d(kInertia / h * w, 12.0 + inductance / h * i));
      w = next[0];
      i = next[1];
      EXPECT_NEAR(v, w, 1e-11 * (1.0 + std::abs(w)));
      EXPECT_NEAR(inverse.actuator_force[0], a.torque_constant * i, 1e-9);
    });
    EXPECT_NEAR(w, 12.0 / K, 1e-6);  // the speed without load
  }
}

/// At rest a motor gives its limit of current, and less where the back-EMF leaves less: the speed-
/// torque curve.
TEST(Actuators, CurrentLimitIsAPlateauOfTorque) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kDcMotor;
  a.torque_constant = 0.5;
  a.resistance = 2.0;
  a.current_limit = 3.0;
  Simulator sim(wheel(a));
  run(sim, 10000, 24.0, [&](const Inverse& inverse, double v) {
    const double torque = std::min(1.5, 0.5 * (24.0 - 0.5 * v) / 2.0);
    EXPECT_NEAR(inverse.actuator_force[0], torque, 1e-9);
  });
  EXPECT_GT(sim.state().v[0], 40.0);  // beyond the plateau, which ends at 36 rad/s
}

/// A PID position law under a constant load: the integral takes the load over, and the error goes.
TEST(Actuators, IntegralTakesTheLoadOver) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kPid;
  a.kp = 20.0;
  a.ki = 30.0;
  a.kd = 5.0;
  Simulator sim(wheel(a));
  sim.input().applied_force = VectorX::Constant(1, -2.0);
  sim.input().command = VectorX::Constant(1, 0.7);
  for (int i = 0; i < 10000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().q[0], 0.7, 1e-9);
  EXPECT_NEAR(30.0 * sim.state().z[1], 2.0, 1e-7);  // z: setpoint, integral
}

/// A stop keeps the wheel from its target: the integral ends at its limit, or waits at the bound of
/// the force, and the wheel leaves the stop at once when the command turns.
TEST(Actuators, IntegralDoesNotWindUp) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kPid;
  a.kp = 10.0;
  a.ki = 10.0;
  a.integral_limit = 1.5;
  Simulator limited(wheel(a, 0.1));
  a.integral_limit = kInfinity;
  a.least = -4.0;
  a.most = 4.0;
  Simulator bounded(wheel(a, 0.1));
  for (Simulator* sim : {&limited, &bounded}) {
    sim->input().command = VectorX::Constant(1, 1.0);
    for (int i = 0; i < 5000; ++i) ASSERT_TRUE(sim->step().succeeded());
  }
  EXPECT_DOUBLE_EQ(10.0 * limited.state().z[0], 1.5);
  EXPECT_LT(10.0 * bounded.state().z[0], 4.0);  // the force is at its bound by kp alone
}

/// First order lag: 1 - exp(-t / T) at every step.
TEST(Actuators, LagIsExact) {
  Actuator a = named("motor");
  a.lag = 0.05;
  Simulator sim(wheel(a));
  int i = 0;
  run(sim, 200, 1.0, [&](const Inverse& inverse, double) {
    EXPECT_NEAR(inverse.actuator_force[0], 1.0 - std::exp(-0.002 * i++ / 0.05), kRoundoff);
  });
}

/// The command passes a slew limit as a ramp.
TEST(Actuators, SlewLimitsTheRate) {
  Actuator a = named("motor");
  a.slew = 10.0;
  Simulator sim(wheel(a));
  int i = 0;
  run(sim, 100, 1.0, [&](const Inverse& inverse, double) {
    EXPECT_NEAR(inverse.actuator_force[0], std::min(1.0, 10.0 * 0.002 * ++i), kRoundoff);
  });
}

/// A delay of 30 ms in 3 samples holds every command for 30 to 40 ms, whatever the step.
TEST(Actuators, DelayHoldsCommandsForItsTime) {
  for (const double h : {0.001, 0.0037, 0.01, 0.05}) {
    Actuator a = named("motor");
    a.delay = 0.03;
    a.delay_samples = 3;
    Scene scene = wheel(a);
    scene.options.time_step = h;
    Simulator sim(scene);
    double arrival = -1.0;
    const int steps = static_cast<int>(std::ceil(0.2 / h));
    int i = 0;
    run(sim, steps, 1.0, [&](const Inverse& inverse, double) {
      const double f = inverse.actuator_force[0];
      EXPECT_TRUE(std::abs(f) < kRoundoff || std::abs(f - 1.0) < kRoundoff) << f;
      if (arrival < 0.0 && f > 0.5) arrival = h * i;
      ++i;
    });
    EXPECT_GE(arrival, 0.03 - 1e-9) << h;
    EXPECT_LT(arrival, std::max(0.04, h) + h) << h;
  }
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
  ModelBuilder builder(Vector3::Zero());
  RobotSpec robot;
  robot.name = "robot";
  LinkSpec base, disk;
  base.name = "base";
  disk.name = "disk";
  disk.inertia.mass = 1.0;
  disk.inertia.rotational = kInertia * Matrix3::Identity();
  robot.links = {base, disk};
  JointSpec joint;
  joint.name = "axle";
  joint.parent = "base";
  joint.child = "disk";
  joint.axis = Vector3::UnitZ();
  robot.joints = {joint};
  builder.add_robot(robot, Base::kFixed, Pose());
  builder.add_actuator({a, "axle", "", "disk", ""});
  Simulator sim(scene_of(builder.build()));
  State start = sim.state();
  start.v[0] = -80.0;
  sim.set_state(start);
  double w = -80.0;
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    EXPECT_NEAR(sim.last_forces().actuator_force[0], w * std::abs(w), 1e-9 * w * w);
    w -= 0.002 * 1e-3 * w * std::abs(w) / kInertia;
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

/// The inverse recovers applied forces beside actuators of every kind.
TEST(Actuators, InverseRecoversAppliedForces) {
  double worst = 0.0;
  int rows = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    test::RandomModelOptions options = test::varied_options(static_cast<int>(seed));
    options.links += 2;
    options.fixed_share = 0.0;
    options.tendons = seed % 2 == 0 ? 1 : 0;
    options.actuators = 4;
    options.armature = true;
    test::Random random(seed);
    Scene scene = test::make_random_scene(seed, options, random);
    rows += static_cast<int>(scene.model.actuators().size());
    Simulator sim(std::move(scene));
    const auto& actuators = sim.model().actuators();
    worst = std::max(worst, test::recover(sim, 60, 1.0, random, [&] {
                       sim.input().command =
                           test::random_vector(static_cast<int>(actuators.size()), random.bits());
                     }));
  }
  EXPECT_LT(worst, test::kRecovered);
  EXPECT_GT(rows, 50);
}

/// The midpoint rule takes them too.
TEST(Actuators, MidpointStepsAreRecovered) {
  test::RandomModelOptions options;
  options.actuators = 5;
  test::Random random(3);
  Scene scene = test::make_random_scene(3, options, random);
  scene.options.integrator = Integrator::kImplicitMidpoint;
  Simulator sim(std::move(scene));
  sim.settings().tolerance = 1e-12;
  for (int i = 0; i < 50; ++i) {
    sim.input().applied_force = test::random_vector(sim.model().nv(), random.bits());
    sim.input().command = test::random_vector(5, random.bits());
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.last_forces();
    const VectorX off = inverse.applied_force - sim.input().applied_force;
    // Poses are rounded, and the contact velocity is read off them.
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-7 * inverse.force_scale) << i;
    EXPECT_LT((inverse.z_next - sim.state().z).norm(), 1e-8) << i;
  }
}

/// Two runs with the same input have the same bits, and one resumed from a file goes on with them.
TEST(Actuators, RunsResumeWithTheSameBits) {
  test::RandomModelOptions options;
  options.actuators = 8;
  options.base = Base::kFixed;
  test::Random random(5);
  const Scene scene = test::make_random_scene(5, options, random);
  ASSERT_GT(scene.model.nz(), 3);
  Simulator first(scene);
  const auto drive = [](Simulator& sim, int from, int to) {
    for (int i = from; i < to; ++i) {
      const auto count = static_cast<int>(sim.model().actuators().size());
      sim.input().command = test::random_vector(count, static_cast<std::uint64_t>(i / 7));
      ASSERT_TRUE(sim.step().succeeded());
    }
  };
  drive(first, 0, 100);
  const test::TempFolder folder;
  const auto file = folder.path() / "state.csv";
  write_state(file, first.model(), first.options(), first.state());
  Simulator second(scene);
  second.set_state(read_state(file, second.model(), second.options()));
  EXPECT_EQ(state_hash(first.state()), state_hash(second.state()));
  drive(first, 100, 200);
  drive(second, 100, 200);
  EXPECT_EQ(state_hash(first.state()), state_hash(second.state()));
}

/// Derivatives are differences of the whole step, and say so.
TEST(Actuators, DerivativesAreDifferencesAndSaySo) {
  test::RandomModelOptions options;
  options.actuators = 4;
  test::Random random(9);
  Simulator sim(test::make_random_scene(9, options, random));
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  Input known = sim.input();
  known.z = before.z;
  Workspace workspace(sim.model());
  Inverse inverse;
  InverseDerivatives d;
  step_inverse_derivatives(sim.model(), sim.options(), before.q, before.v, sim.state().v, known,
                           workspace, inverse, d);
  EXPECT_TRUE(d.by_differences);
  // du/dv+ is the closed form: one column against a difference.
  VectorX v = sim.state().v;
  const double step = 1e-6;
  v[0] += step;
  Inverse moved;
  step_inverse(sim.model(), sim.options(), before.q, before.v, v, known, workspace, moved);
  const VectorX column = (moved.applied_force - inverse.applied_force) / step;
  EXPECT_LT((column - d.dv_next.col(0)).norm(), 1e-5 * d.dv_next.col(0).norm());
}

TEST(Actuators, StepsDoNotAllocate) {
  test::RandomModelOptions options;
  options.actuators = 6;
  test::Random random(4);
  Simulator sim(test::make_random_scene(4, options, random));
  test::expect_no_allocations(sim, 20);
}

TEST(Actuators, BadValuesAreRefused) {
  const auto refuses = [](Actuator a, const std::string& words) {
    try {
      wheel(a);
      ADD_FAILURE() << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  Actuator a = named("");
  refuses(a, "a name is expected");
  a = named("motor");
  a.lag = -1.0;
  refuses(a, "lag must not be negative");
  a = named("motor");
  a.delay = 0.1;
  refuses(a, "delay and delay_samples");
  a = named("motor");
  a.least = -1.0;
  refuses(a, "two finite bounds");
  a = named("motor");
  a.law = ActuatorLaw::kDcMotor;
  refuses(a, "torque_constant must be positive");
  a = named("motor");
  a.law = ActuatorLaw::kMuscle;
  refuses(a, "max_force must be positive");
  a = named("motor");
  a.stiffness = kInfinity;
  refuses(a, "stiffness must not be negative");
  a = named("motor");
  a.transmission = Transmission::kTendon;
  refuses(a, "there is no tendon ''");
  a.transmission = Transmission::kLink;
  refuses(a, "there is no link ''");
}

/// A command that is not finite fails the step with its name.
TEST(Actuators, CommandsThatAreNotFiniteFailTheStep) {
  Simulator sim(wheel(named("motor")));
  sim.input().command = VectorX::Constant(1, std::nan(""));
  const StepReport report = sim.step();
  EXPECT_FALSE(report.succeeded());
  EXPECT_EQ(report.fault.kind, FaultKind::kCommand);
  EXPECT_EQ(describe(sim.model(), report.fault).element, "motor");
  sim.input().command = VectorX::Zero(2);
  EXPECT_THROW(sim.step(), InputError);
}

}  // namespace
}  // namespace counterpoint::actuators_test
