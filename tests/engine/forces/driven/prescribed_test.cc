// Prescribed joints against the motion that they are given, closed forms, and other models.
#include "counterpoint/engine/forces/driven/prescribed.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/special_values.h"
#include "support/linkages.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::prescribed_test {
namespace {

constexpr double kGravity = 9.81;  // [m/s^2]
constexpr double kStep = 0.002;    // [s]
/// Relative error of forces at contacts of bodies that both move at 2 m/s: rounding of their
/// relative velocity. It is the same where the platform is free.
constexpr double kMovingContact = 3e-8;
/// Rounding of angles [rad], forces [N] and momenta [N s] over some hundred steps.
constexpr double kRounding = 1e-11;

JointSpec prismatic(const std::string& name, const Vector3& axis, bool prescribed) {
  JointSpec joint;
  joint.name = name;
  joint.type = JointType::kPrismatic;
  joint.axis = axis;
  joint.prescribed = prescribed;
  return joint;
}

LinkSpec link_of(const std::string& name, double mass) {
  LinkSpec link;
  link.name = name;
  link.inertia = {mass, Vector3::Zero(), 0.02 * Matrix3::Identity()};
  return link;
}

/// A bob of 1.5 kg that hangs 0.7 m below a cart on a rail along x, whose motion may be prescribed.
RobotSpec shaken(bool cart) {
  RobotSpec robot = test::base_only("shaken", "rail");
  std::string pivot = "rail";
  if (cart) {
    robot.links.push_back(link_of("cart", 2.0));
    JointSpec joint = prismatic("x", Vector3::UnitX(), true);
    joint.parent = "rail";
    joint.child = pivot = "cart";
    robot.joints.push_back(joint);
  }
  LinkSpec bob = link_of("bob", 1.5);
  bob.inertia.center = Vector3(0, 0, -0.7);
  robot.links.push_back(bob);
  JointSpec swing;
  swing.name = "swing";
  swing.parent = pivot;
  swing.child = "bob";
  swing.axis = Vector3::UnitY();
  robot.joints.push_back(swing);
  return robot;
}

Simulator simulate(const RobotSpec& robot) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(robot, Base::kFixed, Pose());
  return test::simulate(builder.build(), kStep);
}

void give(Simulator& sim, int coordinate, double target) {
  sim.input().prescribed = VectorX::Constant(sim.model().nq(), kNaN);
  sim.input().prescribed[coordinate] = target;
}

double shake(double t) { return 0.05 * std::sin(11.0 * t) + 0.02 * t; }

/// A pendulum whose pivot is shaken moves as one with a fixed pivot under the inertial force -m a,
/// a the acceleration of the pivot in each step. The force on the cart is that of both masses.
TEST(Prescribed, ShakenPivotIsAnAcceleratingFrame) {
  Simulator sim = simulate(shaken(true)), frame = simulate(shaken(false));
  sim.settings().tolerance = frame.settings().tolerance = 1e-14;
  double speed = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double target = shake((i + 1) * kStep);
    const double next_speed = (target - sim.state().q[0]) / kStep;
    const double a = (next_speed - speed) / kStep;
    speed = next_speed;
    give(sim, 0, target);
    ExternalWrench push;
    push.body = 1;
    push.point = frame.model().body(1).inertia.center;
    push.wrench.force = Vector3(-1.5 * a, 0, 0);
    frame.input().wrenches = {push};
    ASSERT_TRUE(sim.step().succeeded() && frame.step().succeeded());
    ASSERT_EQ(sim.state().q[0], target);
    ASSERT_EQ(sim.state().v[0], next_speed);
    ASSERT_NEAR(sim.state().q[1], frame.state().q[0], kRounding);
    const VectorX force = sim.last_forces().applied_force;
    ASSERT_NEAR(force[1], 0.0, kRounding);
  }
}

/// Lifting m with acceleration a takes m (g + a).
TEST(Prescribed, TheInverseFindsTheForceThatHoldsTheMotion) {
  RobotSpec robot = test::base_only("lift", "frame");
  robot.links.push_back(link_of("load", 3.0));
  JointSpec joint = prismatic("z", Vector3::UnitZ(), true);
  joint.parent = "frame";
  joint.child = "load";
  robot.joints.push_back(joint);
  Simulator sim = simulate(robot);
  const double a = 2.0;
  for (int i = 1; i <= 100; ++i) {
    give(sim, 0, 0.5 * a * kStep * kStep * i * (i + 1));
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_NEAR(sim.last_forces().applied_force[0], 3.0 * (kGravity + a), 1e-8);
  }
}

class PrescribedScene : public testing::Test {
 protected:
  Scene load(const std::string& text) const {
    return load_scene(folder_.write("scene.yaml", text));
  }
  test::TempFolder folder_;
};

/// A platform, a free body whose motion is prescribed, and a box on it.
constexpr const char* kPlatform = R"(gravity: [0, 0, -9.81]
time_step: 0.002
models:
  - {name: platform, box: [1, 1, 0.05], mass: 5, position: [0, 0, 0.5], friction: 0.8, prescribed: true}
  - {name: box, box: [0.1, 0.1, 0.1], mass: 2, position: [0, 0, 0.65], friction: 0.8}
)";

/// Moves the platform along x by `x` [m] and up by `z` [m] from its start.
void move_platform(Simulator& sim, double x, double z) {
  sim.input().prescribed = VectorX::Constant(sim.model().nq(), kNaN);
  sim.input().prescribed.head<7>() << x, 0, 0.5 + z, 1, 0, 0, 0;
}

/// A box rides a platform that accelerates by less than mu g without slip, and presses on it with
/// m (g + a). The platform feels nothing of it.
TEST_F(PrescribedScene, BoxRidesAPlatform) {
  Simulator sim(load(kPlatform));
  sim.settings().tolerance = 1e-13;  // the solver's error must not hide the inverse's
  for (int i = 1; i <= 400; ++i) {
    const double t = i * kStep;
    move_platform(sim, 0.5 * 3.0 * t * t, 0.5 * 1.0 * t * t);
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_EQ(sim.state().q[0], 0.5 * 3.0 * t * t);
    const Inverse& inverse = sim.last_forces();
    ASSERT_LT(inverse.applied_force.tail<6>().cwiseAbs().maxCoeff(),
              kMovingContact * inverse.force_scale);
  }
  // Regularized friction lets it creep by less than a thousandth of the speed.
  EXPECT_NEAR(sim.state().v[6], sim.state().v[0], 1e-3 * sim.state().v[0]);
  const Vector3 pressed = contact_force_on(sim.model(), sim.last_forces(), 2);
  EXPECT_NEAR(pressed.z(), 2.0 * (kGravity + 1.0), 1e-3);
  EXPECT_NEAR(pressed.x(), 2.0 * 3.0, 1e-2);
}

/// On a platform at constant speed a box moves as on a fixed one, also out of an overlap of 5 mm,
/// to the accuracy of displacements (1e-9 of them) and of the solver.
TEST_F(PrescribedScene, OverlapsWithAMovingBodyAreCorrectedAsOnAFixedOne) {
  Scene scene = load(kPlatform);
  scene.q[9] -= 0.005;
  Simulator sim(scene), still(scene);
  const double speed = 0.3;
  for (int i = 1; i <= 200; ++i) {
    move_platform(sim, 0.0, speed * i * kStep);
    ASSERT_TRUE(sim.step().succeeded() && still.step().succeeded());
    ASSERT_NEAR(sim.state().q[9] - sim.state().q[2], still.state().q[9] - still.state().q[2], 1e-7);
    ASSERT_NEAR(sim.state().v[8] - speed, still.state().v[8], 1e-6);
  }
  EXPECT_NEAR(still.state().q[9] - still.state().q[2], 0.15, 1e-5);
}

/// A pusher at constant speed against a box on the ground feels mu m g.
TEST_F(PrescribedScene, PusherFeelsTheFrictionOfWhatItPushes) {
  Simulator sim(load(R"(gravity: [0, 0, -9.81]
time_step: 0.002
ground: {friction: 0.5}
models:
  - {name: pusher, box: [0.05, 0.05, 0.05], mass: 1, position: [-0.16, 0, 0.1], friction: 0, prescribed: true}
  - {name: box, box: [0.1, 0.1, 0.1], mass: 2, position: [0, 0, 0.1], friction: 0.5}
)"));
  for (int i = 1; i <= 400; ++i) {
    sim.input().prescribed = VectorX::Constant(sim.model().nq(), kNaN);
    sim.input().prescribed.head<7>() << -0.16 + 0.2 * i * kStep, 0, 0.1, 1, 0, 0, 0;
    ASSERT_TRUE(sim.step().succeeded());
  }
  EXPECT_NEAR(sim.state().v[6], 0.2, 1e-6);
  const VectorX& force = sim.last_forces().applied_force;
  EXPECT_NEAR(force[0], 0.5 * 2.0 * kGravity, 1e-2);
  EXPECT_NEAR(force[2], 1.0 * kGravity, 1e-6);  // its own weight
}

/// On a platform at rest the box falls asleep; it wakes as the platform starts, with the same bits
/// as without sleeping.
TEST_F(PrescribedScene, SleepingBodiesWakeAsItStarts) {
  const Scene scene = load(kPlatform);
  Scene restless = scene;
  restless.options.effects.set(Effect::kSleeping, false);
  Simulator sleeper(scene), other(restless);
  int asleep = 0;
  for (int i = 0; i < 600; ++i) {
    const double t = std::max(i - 400, 0) * kStep;
    for (Simulator* sim : {&sleeper, &other}) move_platform(*sim, 0.5 * t * t, 0.0);
    const StepReport report = sleeper.step();
    ASSERT_TRUE(report.succeeded() && other.step().succeeded());
    if (i == 400) asleep = report.sleeping_bodies;
    ASSERT_EQ(sleeper.state().q, other.state().q) << "step " << i;
    ASSERT_EQ(sleeper.state().v, other.state().v) << "step " << i;
  }
  EXPECT_EQ(asleep, 2);
  EXPECT_GT(sleeper.state().v[6], 0.1);
}

/// A free body turns as given, with angular velocity log(q^-1 q+) / h in its own axes.
TEST_F(PrescribedScene, FreeBodiesTurnAsGiven) {
  Simulator sim(load(kPlatform));
  const Vector3 turn(0.001, -0.002, 0.003);
  Quaternion at = Quaternion::Identity();
  for (int i = 0; i < 50; ++i) {
    at = (at * quaternion_exp(turn)).normalized();
    sim.input().prescribed = VectorX::Constant(sim.model().nq(), kNaN);
    sim.input().prescribed.head<7>() << 0, 0, 0.5, at.w(), at.x(), at.y(), at.z();
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_LT((sim.state().v.segment<3>(3) - turn / kStep).norm(), 1e-10);
    ASSERT_EQ(sim.state().q[3], at.w());
  }
  const VectorX pose = sim.state().q.head<7>();
  sim.input().prescribed.resize(0);
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_EQ(sim.state().q.head<7>(), pose);
  EXPECT_TRUE(sim.state().v.head<6>().isZero(0.0));
}

/// The inverse knows nothing of prescribed joints, and has closed forms of their derivatives, too.
TEST(Prescribed, DerivativesOfTheInverseAreExact) {
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(shaken(true), Base::kFixed, Pose());
  Scene scene = scene_of(builder.build());
  scene.options.time_step = kStep;
  scene.q[1] = 0.4;
  Simulator sim(scene);
  for (int i = 0; i < 5; ++i) {
    const State before = sim.state();
    give(sim, 0, shake((i + 1) * kStep));
    ASSERT_TRUE(sim.step().succeeded());
    test::expect_exact(scene, {before.q, before.v, sim.state().v, Input()}, "shaken");
  }
}

/// A prescribed joint inside a free robot leaves its momentum alone.
TEST(Prescribed, InternalMotionKeepsMomentum) {
  RobotSpec robot = test::base_only("robot", "trunk");
  robot.links[0] = link_of("trunk", 4.0);
  robot.links.push_back(link_of("arm", 1.0));
  JointSpec joint = prismatic("slide", Vector3(1, 2, 0), true);
  joint.parent = "trunk";
  joint.child = "arm";
  robot.joints.push_back(joint);
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFloating, Pose());
  Simulator sim = test::simulate(builder.build(), kStep);
  const Force before = total_momentum(sim.model(), test::kinematics_of(sim));
  for (int i = 1; i <= 300; ++i) {
    give(sim, 7, 0.1 * std::sin(5.0 * i * kStep));
    ASSERT_TRUE(sim.step().succeeded());
  }
  const Force after = total_momentum(sim.model(), test::kinematics_of(sim));
  EXPECT_LT((after.force - before.force).norm(), kRounding);
  EXPECT_GT(sim.state().v.head<3>().norm(), 1e-3);
}

TEST_F(PrescribedScene, DoesNotAllocate) {
  Simulator sim(load(kPlatform));
  move_platform(sim, 0.0, 0.0);
  test::expect_no_allocations(sim, 20);
}

/// Columns of tables: J.target of joints of one coordinate, L.target_x ... of others; an empty cell
/// leaves a joint where it stands.
TEST_F(PrescribedScene, HasColumnsInTables) {
  const Model model = load(kPlatform).model;
  const std::string names = "platform/body.target_";
  const InputColumns all = InputColumns::of(model);
  ASSERT_TRUE(all.prescribed);
  EXPECT_EQ(all.names(model)[0], names + "x");
  EXPECT_EQ(all.names(model)[6], names + "qz");
  EXPECT_EQ(
      InputColumns::of(simulate(shaken(true)).model()).names(simulate(shaken(true)).model())[0],
      "x.target");
  const Table table(folder_.write("in.csv", "time," + names + "x," + names + "y," + names + "z," +
                                                names + "qw," + names + "qx," + names + "qy," +
                                                names + "qz\n0,0.1,0,0.5,0.5,0,0,0\n1,,,,,,,\n"));
  const InputColumns columns = find_input_columns(table, model);
  const MatrixX values = read_input_columns(columns, table, model, 2);
  Input input;
  columns.set(model, values.col(0), input);
  EXPECT_EQ(input.prescribed[0], 0.1);
  EXPECT_EQ(input.prescribed[3], 1.0);  // scaled to unit length
  EXPECT_TRUE(std::isnan(input.prescribed[7]));
  columns.set(model, values.col(1), input);
  EXPECT_TRUE(input.prescribed.array().isNaN().all());
}

TEST_F(PrescribedScene, RefusesWhatItCannotFollow) {
  Scene scene = load(kPlatform);
  for (const Integrator integrator : {Integrator::kImplicitMidpoint, Integrator::kRungeKutta4}) {
    Scene other = scene;
    other.options.integrator = integrator;
    other.options.effects.set(Effect::kContacts, false);
    Simulator sim(other);
    EXPECT_THROW(sim.step(), InputError);
  }
  Simulator sim(scene);
  move_platform(sim, kInfinity, 0.0);
  EXPECT_THROW(sim.step(), InputError);
  move_platform(sim, 0.0, 0.0);
  sim.input().prescribed[3] = 0.5;
  EXPECT_THROW(sim.step(), InputError);
  sim.input().prescribed = VectorX::Zero(3);
  EXPECT_THROW(sim.step(), InputError);
  RobotSpec robot = shaken(true);
  robot.joints[0].servo.stiffness = 10.0;
  EXPECT_THROW(simulate(robot), InputError);
  EXPECT_THROW(load("models:\n  - {box: [1, 1, 1], mass: 1, base: fixed, prescribed: true}\n"),
               InputError);
}

/// A mocap body of an MJCF file is a free body that follows its input, from the pose of a keyframe
/// on; a weld makes another body follow it.
TEST_F(PrescribedScene, MocapBodiesOfMjcfFollowTheirInput) {
  const std::string xml = R"(<mujoco><option gravity="0 0 0"/><worldbody>
<body name="target" mocap="true" pos="1 2 3" euler="0 0 90"/>
<body name="hand" pos="0 0 1"><freejoint/><geom size="0.1"/></body></worldbody>
<equality><weld body1="target" body2="hand" relpose="0 0 0 1 0 0 0"/></equality>
<keyframe><key name="home" mpos="0 0 1" mquat="1 0 0 0" qpos="0 0 1 1 0 0 0"/></keyframe></mujoco>)";
  const auto file = folder_.write("mocap.xml", xml);
  Simulator sim(load_scene(file));
  const Model& model = sim.model();
  const int target = model.find_joint("target");
  ASSERT_GE(target, 0);
  ASSERT_TRUE(model.joint(target).prescribed);
  const int first = model.body(target + 1).q_index;
  EXPECT_LE(
      (sim.state().q.segment<7>(first) - (VectorX(7) << 0, 0, 1, 1, 0, 0, 0).finished()).norm(),
      1e-15);
  const int hand = model.body(model.find_joint("hand") + 1).q_index;
  sim.input().prescribed = VectorX::Constant(model.nq(), std::numeric_limits<double>::quiet_NaN());
  constexpr double kSpeed = 0.1;  // [m/s]
  for (int i = 1; i <= 500; ++i) {
    sim.input().prescribed.segment<7>(first) << kSpeed * i * kStep, 0, 1, 1, 0, 0, 0;
    ASSERT_TRUE(sim.step().succeeded());
  }
  EXPECT_EQ(sim.state().q[first], kSpeed * 500 * kStep);
  // At constant speed the weld carries nothing, so its compliance has no part.
  EXPECT_NEAR(sim.state().q[hand], kSpeed * 500 * kStep, 1e-6);
  const std::string still = "models:\n  - {mjcf: mocap.xml, leave_out: [mocap], keyframe: none}\n";
  EXPECT_EQ(load_scene(folder_.write("still.yaml", still)).model.find_joint("target"), -1);
  folder_.write("jointed.xml",
                "<mujoco><worldbody><body mocap='true'><joint/><geom size='1'/>"
                "</body></worldbody></mujoco>");
  EXPECT_THROW(load_scene(folder_.write("jointed.yaml", "models: [{mjcf: jointed.xml}]")),
               InputError);
}

}  // namespace
}  // namespace counterpoint::prescribed_test
