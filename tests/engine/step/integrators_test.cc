// Integrators: order, conservation, inverse, and refused options.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/allocation_guard.h"
#include "support/linkages.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::integrators_test {
namespace {

/// Spherical, revolute and prismatic joints, springs, damping, drag, rotors, gravity; no
/// constraints.
Simulator smooth_tree(int seed, Integrator integrator, double h) {
  test::Random random(seed);
  Scene scene = test::make_random_scene(seed,
                                        {.links = 4,
                                         .base = Base::kFloating,
                                         .damping = true,
                                         .armature = true,
                                         .springs = true,
                                         .drag = true},
                                        random);
  scene.options.time_step = h;
  scene.options.integrator = integrator;
  scene.options.effects = EffectSet::all().without({Effect::kContacts});
  return Simulator(std::move(scene));
}

/// Two rods on ball joints, fixed at one end, with an initial velocity.
Simulator free_chain(Integrator integrator, double h) {
  ModelBuilder builder;
  RobotSpec robot;
  robot.name = "chain";
  robot.links.resize(3);
  for (int i = 0; i < 3; ++i) robot.links[i].name = "link" + std::to_string(i);
  for (int i = 1; i < 3; ++i) {
    robot.links[i].inertia =
        SpatialInertia{1.0, Vector3(0, 0, -0.5), Vector3(0.1, 0.08, 0.02).asDiagonal()};
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.type = JointType::kSpherical;
    joint.parent = robot.links[i - 1].name;
    joint.child = robot.links[i].name;
    if (i == 2) joint.X_PJ.translation.z() = -1.0;
    robot.joints.push_back(joint);
  }
  builder.add_robot(robot, Base::kFixed, Pose(), "");
  Simulator sim = test::simulate(builder.build(), h);
  sim.options().integrator = integrator;
  State state = sim.state();
  state.v << 8.0, 1.0, 3.0, -4.0, 2.0, 5.0;
  sim.set_state(state);
  return sim;
}

VectorX end_of(Simulator sim, double duration) {
  const long steps = std::lround(duration / sim.options().time_step);
  for (long i = 0; i < steps; ++i) {
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << i;
  }
  VectorX x(sim.model().nq() + sim.model().nv());
  x << sim.state().q, sim.state().v;
  return x;
}

struct Order {
  Integrator integrator;
  double order;
  double coarse;  ///< [s]
};
void PrintTo(const Order& order, std::ostream* out) { *out << integrator_name(order.integrator); }

class Integrators : public ::testing::TestWithParam<Order> {};
INSTANTIATE_TEST_SUITE_P(All, Integrators,
                         ::testing::Values(Order{Integrator::kSemiImplicitEuler, 1, 1e-4},
                                           Order{Integrator::kImplicitMidpoint, 2, 1e-3},
                                           Order{Integrator::kRungeKutta4, 4, 4e-3}),
                         [](const auto& p) {
                           return std::string(integrator_name(p.param.integrator));
                         });

TEST_P(Integrators, HaveTheirOrder) {
  // Springs, damping, rotors, drag, gravity; floating base, every joint type of the random trees.
  for (int seed = 1; seed <= 5; ++seed) {
    // Its own error is (1e-4 / 4e-3)^4 of that of its coarsest step below.
    const VectorX exact = end_of(smooth_tree(seed, Integrator::kRungeKutta4, 1e-4), 0.2);
    double last = 0.0;
    for (const double h : {GetParam().coarse, GetParam().coarse / 2, GetParam().coarse / 4}) {
      const double error =
          (end_of(smooth_tree(seed, GetParam().integrator, h), 0.2) - exact).norm();
      // At these steps the next order's part is below 5 % of the leading one, except for 40 % in
      // order four at its coarsest.
      if (last > 0.0) {
        EXPECT_NEAR(std::log2(last / error), GetParam().order, 0.5) << seed;
      }
      last = error;
    }
  }
}

TEST(ImplicitMidpoint, ConservesEnergyOfABallJointChainAndATop) {
  // A double pendulum on ball joints that turns over: the energy error oscillates without drift.
  Simulator sim = free_chain(Integrator::kImplicitMidpoint, 2e-3);
  const double start = test::energy(sim).total();
  const double swing = test::energy(sim).kinetic;
  double first = 0.0, later = 0.0, largest = 0.0, largest_of_first = 0.0;
  for (int i = 0; i < 20000; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    const double off = std::abs(test::energy(sim).total() - start);
    largest = std::max(largest, off);
    if (i < 5000) largest_of_first = largest;
    i < 5000 ? first += off / 5000 : later += off / 15000;
  }
  // (h omega)^2 of the kinetic energy, omega about 10 rad/s.
  EXPECT_LT(largest_of_first, 4e-3 * swing);
  // The motion is chaotic, and where it turns over fast the error is a few times as large.
  EXPECT_LT(largest, 2e-2 * swing);
  // The ratio of the means is 0.5 to 1.4 at twelve starts that differ by 1e-13.
  EXPECT_LT(later, 2.0 * first) << "it does not grow";
}

TEST(ImplicitMidpoint, TheInverseReturnsWhatWasApplied) {
  for (int seed = 1; seed <= 10; ++seed) {
    Simulator sim = smooth_tree(seed, Integrator::kImplicitMidpoint, 2e-3);
    sim.input().applied_force = test::random_vector(sim.model().nv(), seed, 3.0);
    for (int i = 0; i < 100; ++i) {
      const VectorX q = sim.state().q, v = sim.state().v;
      ASSERT_TRUE(sim.step().succeeded());
      const Inverse& inverse = sim.inverse(q, v, sim.state().v);
      // The fixed point is accurate to rounding of velocities, which is divided by h / 2 in forces.
      EXPECT_LT((inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff(),
                1e-10 * inverse.force_scale)
          << seed << " " << i;
    }
  }
}

TEST(ImplicitMidpoint, ABlockSlidesToRestAndTheInverseFindsItsPush) {
  Scene scene = test::box_on_plane({.mass = 2.0, .friction = 0.5});
  scene.options.integrator = Integrator::kImplicitMidpoint;
  Simulator sim(std::move(scene));
  const double h = sim.options().time_step, mu = 0.5, g = 9.81, speed = 2.0;
  State state = sim.state();
  state.v[0] = speed;
  sim.set_state(state);
  const auto step = [&](double push) {
    const VectorX q = sim.state().q, v = sim.state().v;
    sim.input().applied_force.setZero();
    sim.input().applied_force[0] = push;
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.inverse(q, v, sim.state().q, sim.state().v);
    // w_c comes from positions of half a metre, rounded to 1.1e-16 of that, at both ends of the
    // step. Divided by h this is a velocity, by r = eps / m an impulse, by h again a force.
    const double rounding = 2.0 * 1.1e-16 * 0.5 / (h * h * 1e-6 / 2.0);
    EXPECT_LT((inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff(), rounding);
  };
  for (int i = 0; i < 500; ++i) step(0.0);
  // v0^2 / (2 mu g): impulses at mid-step brake it as evenly as friction does.
  EXPECT_NEAR(sim.state().q[0] - state.q[0], speed * speed / (2 * mu * g), 2.0 * speed * h);
  EXPECT_NEAR(sim.state().q[2], state.q[2], 1e-6);
  const double rest = sim.state().q[0];
  for (int i = 0; i < 100; ++i) step(0.9 * mu * 2.0 * g);
  EXPECT_NEAR(sim.state().q[0], rest, 1e-6) << "inside the cone it stays";
  for (int i = 0; i < 100; ++i) step(1.5 * mu * 2.0 * g);
  EXPECT_GT(sim.state().q[0], rest + 1e-3);
}

/// A light finger on a stiff servo, a spring and a damper, held by its stop. At any step it presses
/// with their force at the stop, not with the force that they would have if it moved on.
TEST(ImplicitMidpoint, AFingerAtItsStopPressesWithTheForceOfItsServo) {
  const double mass = 0.02, kp = 800.0, kd = 20.0, target = 0.03, stiffness = 100.0,
               reference = 0.02;
  for (const double h : {1e-2, 1e-3, 1e-4}) {
    test::Slider finger;
    finger.mass = mass;
    finger.upper = 0.0;
    finger.servo = {kp, kd, target, 0.0};
    finger.stiffness = stiffness;
    finger.reference = reference;
    finger.damping = 3.0;
    Scene scene = test::slider(finger);
    scene.options.time_step = h;
    scene.options.integrator = Integrator::kImplicitMidpoint;
    Simulator sim(std::move(scene));
    State last = sim.state();
    for (int i = 0; i < 100; ++i) {
      last = sim.state();
      ASSERT_TRUE(sim.step().succeeded());
    }
    const Inverse& inverse = sim.inverse(last.q, last.v, sim.state().q, sim.state().v);
    // The stop yields by the overlap that balances the load, r f h / beta with r = eps / m; servo
    // and spring pull that much less. Rounding, as in the test above, of positions of 1 um.
    const double press = kp * target + stiffness * reference;
    const ContactOptions& contact = sim.options().contact;
    const double overlap = contact.compliance / mass * press * h * h / contact.stabilization;
    const double tolerance = 1.1 * (kp + stiffness) * overlap + 1e-6 * press;
    EXPECT_NEAR(inverse.contact_force[0], -press, tolerance) << h;
    EXPECT_NEAR(inverse.servo_force[0], kp * target, tolerance) << h;
    EXPECT_NEAR(inverse.applied_force[0], 0.0, tolerance) << h;
  }
}

TEST(ImplicitMidpoint, InverseWithConstraintsNeedsTheEnd) {
  Scene scene = test::box_on_plane({});
  scene.options.integrator = Integrator::kImplicitMidpoint;
  Simulator sim(std::move(scene));
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_THROW(sim.inverse(before.q, before.v, sim.state().v), InputError);
}

TEST(RungeKutta4, RefusesConstraintsAndTheInverse) {
  Scene scene = test::box_on_plane({});
  scene.options.integrator = Integrator::kRungeKutta4;
  Simulator sim(scene);
  try {
    sim.step();
    FAIL() << "contacts";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("contacts"), std::string::npos) << error.what();
  }
  scene.options.effects = EffectSet::all().without({Effect::kContacts});
  Simulator free(scene);
  const State before = free.state();
  ASSERT_TRUE(free.step().succeeded());
  EXPECT_THROW(free.inverse(before.q, before.v, free.state().v), InputError);
}

TEST(HigherOrder, LeaveNothingBehindForAnotherIntegrator) {
  // Fast, with rotors: values that the semi-implicit step stores must not be used after a step of
  // another integrator, slow this time.
  for (const Integrator other : {Integrator::kImplicitMidpoint, Integrator::kRungeKutta4}) {
    Simulator used = smooth_tree(3, Integrator::kSemiImplicitEuler, 2e-3);
    const State slow = used.state();
    State fast = slow;
    fast.v *= 30.0;
    used.set_state(fast);
    ASSERT_TRUE(used.step().succeeded());
    used.set_state(slow);
    used.options().integrator = other;
    ASSERT_TRUE(used.step().succeeded());
    used.set_state(slow);
    used.options().integrator = Integrator::kSemiImplicitEuler;
    ASSERT_TRUE(used.step().succeeded());
    Simulator fresh = smooth_tree(3, Integrator::kSemiImplicitEuler, 2e-3);
    ASSERT_TRUE(fresh.step().succeeded());
    EXPECT_EQ(used.state().v, fresh.state().v) << integrator_name(other);
  }
}

TEST(HigherOrder, StepsDoNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  for (const Integrator integrator : {Integrator::kImplicitMidpoint, Integrator::kRungeKutta4}) {
    Simulator sim = smooth_tree(3, integrator, 2e-3);
    for (int i = 0; i < 10; ++i) sim.step();
    const std::size_t before = test::allocation_count();
    for (int i = 0; i < 100; ++i) sim.step();
    EXPECT_EQ(test::allocation_count() - before, 0u) << integrator_name(integrator);
  }
}

}  // namespace
}  // namespace counterpoint::integrators_test
