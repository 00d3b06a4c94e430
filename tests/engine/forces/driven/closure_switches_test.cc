// Switched closures: the loads that they hold, their breaking, and the inverse of both.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/special_values.h"
#include "support/linkages.h"
#include "support/recover.h"
#include "support/step_derivatives.h"
#include "support/temp_folder.h"

namespace counterpoint::closure_switches_test {
namespace {

using test::kRecovered;

constexpr double kGravity = 9.81;              // [m/s^2]
constexpr double kCarrier = 2.0, kLoad = 1.5;  // masses of the carrier and of the load [kg]
constexpr double kMargin = 1e-3;               // limits differ by this from the load [-]
/// Steps within which the compliance of a closure has taken up its load.
constexpr int kSettled = 20;

/// A carrier "cup" on a prismatic joint along z, 0.2 m above a free box "box/body", and a closure
/// between them; all in steps of 2 ms.
struct Hoist {
  ClosureSpec grip = {};
  Vector3 box_at = Vector3(0.05, -0.03, 0.8);
  Matrix3 box_turned = quaternion_exp(Vector3(0.1, 0.4, -0.2)).toRotationMatrix();
  Vector3 gravity = Vector3(0, 0, -kGravity);

  Hoist() {
    grip.name = "grip";
    grip.type = ClosureType::kWeld;
    grip.switched = grip.in_place = true;
    grip.attached = false;
  }
  Scene scene() const {
    RobotSpec robot = test::base_only("hoist", "frame");
    LinkSpec cup;
    cup.name = "cup";
    cup.inertia = {kCarrier, Vector3::Zero(), 0.01 * Matrix3::Identity()};
    robot.links.push_back(cup);
    JointSpec lift;
    lift.name = "lift";
    lift.type = JointType::kPrismatic;
    lift.parent = "frame";
    lift.child = "cup";
    lift.axis = Vector3::UnitZ();
    lift.X_PJ.translation = Vector3(0, 0, 1);
    robot.joints.push_back(lift);
    Shape shape;
    shape.type = ShapeType::kBox;
    shape.size = Vector3(0.1, 0.08, 0.05);
    ModelBuilder builder(gravity);
    builder.add_robot(robot, Base::kFixed, Pose());
    builder.add_robot(object_of("box", shape, kLoad), Base::kFloating, {box_turned, box_at},
                      "box/");
    ClosureSpec closure = grip;
    closure.link_a = "cup";
    closure.link_b = "box/body";
    builder.add_closure(closure);
    Scene scene{"hoist", builder.build(), {}, {}, {}};
    scene.q = scene.model.default_q();
    scene.v = VectorX::Zero(scene.model.nv());
    scene.options.time_step = 0.002;
    return scene;
  }
};

void attach(Simulator& sim, double input) { sim.input().attach = VectorX::Constant(1, input); }

/// Drives the lift with a force [N].
void pull(Simulator& sim, double force) {
  sim.input().applied_force = VectorX::Zero(sim.model().nv());
  sim.input().applied_force[0] = force;
}

double state_of(const Simulator& sim) { return sim.state().z[0]; }

Pose box_in_cup(const Simulator& sim) {
  const std::vector<Pose> X_WB = body_poses(sim.model(), sim.state().q);
  return X_WB[1].inverse() * X_WB[2];
}

/// Steps, and expects the inverse to recover the force and the internal states of every step.
void run(Simulator& sim, int steps) {
  sim.settings().tolerance = 1e-13;  // the solver's error must not hide the inverse's
  for (int i = 0; i < steps; ++i) {
    const VectorX force = sim.input().applied_force;
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.last_forces();
    const VectorX expected = force.size() > 0 ? force : VectorX::Zero(sim.model().nv());
    ASSERT_LT((inverse.applied_force - expected).cwiseAbs().maxCoeff(),
              kRecovered * std::max(inverse.force_scale, 1.0))
        << "step " << i;
    ASSERT_EQ(inverse.z_next, sim.state().z) << "step " << i;
  }
}

/// The closure carries m (g + a) while a force F = (M + m) (g + a) lifts carrier and load: a limit
/// a thousandth above holds, one a thousandth below breaks.
TEST(ClosureSwitches, BreaksAboveTheLoadAndHoldsBelow) {
  const double acceleration = 3.0;  // [m/s^2]
  const double load = kLoad * (kGravity + acceleration);
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint}) {
    for (const double limit : {load * (1.0 + kMargin), load * (1.0 - kMargin)}) {
      Hoist hoist;
      hoist.box_at = Vector3(0, 0, 0.8);
      hoist.grip.breaking_force = limit;
      Scene scene = hoist.scene();
      scene.options.integrator = integrator;
      Simulator sim(std::move(scene));
      attach(sim, 1.0);
      pull(sim, (kCarrier + kLoad) * (kGravity + acceleration));
      sim.settings().tolerance = 1e-13;
      for (int i = 0; i < kSettled; ++i) {
        ASSERT_TRUE(sim.step().succeeded());
        ASSERT_EQ(sim.last_forces().z_next, sim.state().z);
      }
      EXPECT_EQ(state_of(sim), limit > load ? Closure::kAttached : Closure::kBroken);
      if (limit < load) continue;
      EXPECT_NEAR(sim.last_forces().closures[0].force.force.norm(), load, 1e-6 * load);
    }
  }
}

/// A load at a lever of l carries a torque m (g + a) l about A's anchor.
TEST(ClosureSwitches, BreaksByTheTorqueAboutTheAnchorOfA) {
  const double lever = 0.05, torque = kLoad * kGravity * lever;
  for (const double limit : {torque * (1.0 + kMargin), torque * (1.0 - kMargin)}) {
    Hoist hoist;
    hoist.box_at = Vector3(lever, 0, 0.8);
    hoist.grip.breaking_torque = limit;
    Simulator sim(hoist.scene());
    attach(sim, 1.0);
    pull(sim, (kCarrier + kLoad) * kGravity);
    run(sim, kSettled);
    EXPECT_EQ(state_of(sim), limit > torque ? Closure::kAttached : Closure::kBroken);
  }
}

TEST(ClosureSwitches, HoldsThePoseInWhichItWasAttached) {
  Simulator sim(Hoist().scene());
  pull(sim, kCarrier * kGravity);
  run(sim, 10);  // the box falls
  const Pose before = box_in_cup(sim);
  attach(sim, 1.0);
  pull(sim, 1.3 * (kCarrier + kLoad) * kGravity);
  run(sim, 300);
  const Pose after = box_in_cup(sim);
  // The weld takes the speed of the fall away in one step, and the load of 20 N opens it by its
  // compliance: less than a micrometre.
  EXPECT_LT((after.translation - before.translation).norm(), 1e-6);
  EXPECT_LT((after.rotation - before.rotation).norm(), 1e-6);
  EXPECT_GT(sim.state().q[0], 0.1);
  attach(sim, 0.0);
  const double height = sim.state().q[3];
  run(sim, 400);
  EXPECT_EQ(state_of(sim), Closure::kReleased);
  EXPECT_LT(sim.state().q[3], height);
}

/// A broken closure stays open until it has been released and attached again; empty and NaN leave a
/// closure as it is.
TEST(ClosureSwitches, StaysBrokenUntilReleasedAndAttachedAgain) {
  Hoist hoist;
  hoist.grip.breaking_force = 0.5 * kLoad * kGravity;
  hoist.box_at = Vector3(0, 0, 0.8);
  Simulator sim(hoist.scene());
  const auto expect_after = [&](double input, double force, double state) {
    attach(sim, input);
    pull(sim, force);
    run(sim, 1);
    EXPECT_EQ(state_of(sim), state) << "input " << input;
  };
  const double falling = 0.0, held = (kCarrier + kLoad) * kGravity;
  expect_after(kNaN, falling, Closure::kReleased);
  expect_after(1.0, falling, Closure::kAttached);  // both fall: no force
  expect_after(kNaN, falling, Closure::kAttached);
  expect_after(1.0, held, Closure::kBroken);
  expect_after(1.0, falling, Closure::kBroken);
  expect_after(kNaN, falling, Closure::kBroken);
  sim.input().attach.resize(0);
  run(sim, 1);
  EXPECT_EQ(state_of(sim), Closure::kBroken);
  expect_after(0.0, falling, Closure::kReleased);
  expect_after(1.0, falling, Closure::kAttached);
}

/// An open closure leaves the bits of a motion as they are without it, and adds no row.
TEST(ClosureSwitches, OpenClosuresChangeNothing) {
  const Scene with = Hoist().scene();
  Simulator one(with);
  Scene other = with;
  other.options.effects.set(Effect::kClosures, false);
  Simulator two(other);
  for (int i = 0; i < 200; ++i) {
    const StepReport report = one.step();
    ASSERT_TRUE(report.succeeded() && two.step().succeeded());
    ASSERT_EQ(report.constraint_rows, 0);
    ASSERT_EQ(one.state().q, two.state().q);
    ASSERT_EQ(one.state().v, two.state().v);
  }
}

/// Two free bodies keep their momentum whether they are tied or not.
TEST(ClosureSwitches, KeepsMomentumWhileItSwitches) {
  Shape shape;  // spheres, whose spin is integrated exactly
  shape.size = Vector3(0.1, 0, 0);
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(object_of("a", shape, 1.0), Base::kFloating, Pose(), "a/");
  builder.add_robot(object_of("b", shape, 2.0), Base::kFloating,
                    {Matrix3::Identity(), Vector3(0.5, 0, 0)}, "b/");
  ClosureSpec grip = Hoist().grip;
  grip.link_a = "a/body";
  grip.link_b = "b/body";
  builder.add_closure(grip);
  Simulator sim = test::simulate(builder.build());
  test::set_random_velocities(sim, 0.3);
  int step = 0;
  attach(sim, 0.0);
  test::expect_momentum_kept(sim, [&] { attach(sim, ++step / 50 % 2); });
}

/// Sleeping boxes wake when they are tied, with the same bits as without sleeping.
TEST(ClosureSwitches, WakesSleepingBodies) {
  const test::TempFolder folder;
  const Scene scene = load_scene(folder.write("scene.yaml", R"(ground: {friction: 0.5}
models:
  - {name: a, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.1]}
  - {name: b, box: [0.1, 0.1, 0.1], mass: 1, position: [1, 0, 0.1]}
closures:
  - {type: distance, between: [a/body, b/body], length: 0.9, switched: true, attached: false}
)"));
  Scene restless = scene;
  restless.options.effects.set(Effect::kSleeping, false);
  Simulator sleeper(scene), other(restless);
  int asleep = 0;
  for (int i = 0; i < 800; ++i) {
    for (Simulator* sim : {&sleeper, &other}) attach(*sim, i >= 400 && i < 600 ? 1.0 : 0.0);
    const StepReport report = sleeper.step();
    ASSERT_TRUE(report.succeeded() && other.step().succeeded());
    if (i == 399) asleep = report.sleeping_bodies;
    if (i == 400) {
      EXPECT_EQ(report.sleeping_bodies, 0);
    }
    ASSERT_EQ(sleeper.state().q, other.state().q) << "step " << i;
    ASSERT_EQ(sleeper.state().v, other.state().v) << "step " << i;
  }
  EXPECT_EQ(asleep, 2);
  EXPECT_LT(sleeper.state().q[7] - sleeper.state().q[0], 0.95);
}

/// A run resumed from a state file goes on with the same bits, attached in place.
TEST(ClosureSwitches, ResumesFromAStateFile) {
  const test::TempFolder folder;
  Simulator sim(Hoist().scene());
  attach(sim, 1.0);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(sim.step().succeeded());
  sim.input().attach.resize(0);
  const std::filesystem::path file = folder.path() / "state.csv";
  write_state(file, sim.model(), sim.options(), sim.state());
  Simulator resumed(Hoist().scene());
  resumed.set_state(read_state(file, resumed.model(), resumed.options()));
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(sim.step().succeeded() && resumed.step().succeeded());
  EXPECT_EQ(state_hash(sim.state()), state_hash(resumed.state()));
}

/// The derivatives are those with the closures as they are.
TEST(ClosureSwitches, DerivativesHoldThePoseInPlace) {
  const Scene scene = Hoist().scene();
  Simulator sim(scene);
  attach(sim, 1.0);
  pull(sim, 30.0);
  for (int i = 0; i < 20; ++i) {
    const State before = sim.state();
    ASSERT_TRUE(sim.step().succeeded());
    if (i < 2) continue;
    Input known;
    known.z = before.z;
    test::expect_exact(scene, {before.q, before.v, sim.state().v, known}, "attached");
  }
}

TEST(ClosureSwitches, DoesNotAllocate) {
  Simulator sim(Hoist().scene());
  attach(sim, 1.0);
  test::expect_no_allocations(sim, 20);
}

/// runge_kutta_4 holds switched closures, too, but finds no force that could break them.
TEST(ClosureSwitches, RungeKuttaHoldsWhatCannotBreak) {
  Hoist hoist;
  Scene scene = hoist.scene();
  scene.options.integrator = Integrator::kRungeKutta4;
  Simulator sim(scene);
  const Pose before = box_in_cup(sim);
  attach(sim, 1.0);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_LT((box_in_cup(sim).translation - before.translation).norm(), 1e-10);
  attach(sim, 0.0);
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_EQ(state_of(sim), Closure::kReleased);
  hoist.grip.breaking_force = 10.0;
  scene = hoist.scene();
  scene.options.integrator = Integrator::kRungeKutta4;
  Simulator refused(scene);
  EXPECT_THROW(refused.step(), InputError);
}

/// The columns of a table give back the inputs; an empty cell leaves a closure as it is.
TEST(ClosureSwitches, HasColumnsInTables) {
  const test::TempFolder folder;
  const Model model = Hoist().scene().model;
  const Table table(folder.write("inputs.csv", "time,grip.attach\n0,\n0.1,1\n0.2,0\n"));
  const InputColumns columns = find_input_columns(table, model);
  ASSERT_TRUE(columns.closures);
  const MatrixX values = read_input_columns(columns, table, model, 3);
  EXPECT_TRUE(std::isnan(values(0, 0)));
  EXPECT_EQ(values(0, 1), 1.0);
  EXPECT_EQ(values(0, 2), 0.0);
  Input input;
  columns.set(model, values.col(1), input);
  EXPECT_EQ(input.attach, VectorX::Ones(1));
  EXPECT_EQ(columns.values(model, input), values.col(1));
  const Table wrong(folder.write("wrong.csv", "time,grip.attach\n0,2\n"));
  EXPECT_THROW(read_input_columns(columns, wrong, model, 1), InputError);
}

TEST(ClosureSwitches, RefusesInputsAndStatesThatMeanNothing) {
  Simulator sim(Hoist().scene());
  attach(sim, 0.5);
  EXPECT_THROW(sim.step(), InputError);
  sim.input().attach = VectorX::Zero(2);
  EXPECT_THROW(sim.step(), InputError);
  sim.input().attach.resize(0);
  State state = sim.state();
  state.z[0] = 0.5;
  sim.set_state(state);
  EXPECT_THROW(sim.step(), InputError);
  state.z[0] = Closure::kAttached;
  state.z[4] = 2.0;  // qw
  sim.set_state(state);
  EXPECT_THROW(sim.step(), InputError);
}

}  // namespace
}  // namespace counterpoint::closure_switches_test
