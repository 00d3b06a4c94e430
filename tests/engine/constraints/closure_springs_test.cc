// Closures with springs and dampers (bushings), and ropes, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "counterpoint/engine/dynamics.h"
#include "support/allocation_guard.h"
#include "support/linkages.h"
#include "support/recover.h"

namespace counterpoint::closure_springs_test {
namespace {

using test::kinematics_of;
using test::kRecovered;
using test::simulate;

constexpr double kGravity = 9.81;  // [m/s^2]

RobotSpec ball_of(double m, double inertia) {
  RobotSpec robot = test::base_only("ball", "body");
  robot.links[0].inertia = {m, Vector3::Zero(), inertia * Matrix3::Identity()};
  return robot;
}

/// One free ball, `below` [m] under the origin, tied to the world there.
Model tied_ball(double m, double inertia, ClosureSpec closure, double below = 0.0,
                const Vector3& gravity = Vector3(0, 0, -kGravity)) {
  ModelBuilder builder(gravity);
  Pose start;
  start.translation.z() = -below;
  builder.add_robot(ball_of(m, inertia), Base::kFloating, start);
  closure.link_a = "world";
  closure.link_b = "body";
  builder.add_closure(closure);
  return builder.build();
}

/// Steps and compares one coordinate with backward Euler for m x'' = -k x - d x' + f,
/// (m + h d + h^2 k) v+ = m v + h (f - k x), to the rounding of the poses.
void expect_oscillator(Simulator& sim, int coordinate, int velocity, double m, double k, double d,
                       double f, double x, double v) {
  const double h = sim.options().time_step;
  for (int n = 0; n < 1000; ++n) {
    ASSERT_TRUE(sim.step().succeeded());
    v = (m * v + h * (f - k * x)) / (m + h * d + h * h * k);
    x += h * v;
    ASSERT_NEAR(sim.state().q[coordinate], x, 1e-9) << n;
    ASSERT_NEAR(sim.state().v[velocity], v, 1e-8) << n;
  }
}

TEST(Bushing, OfABallOscillatesAlongEachAxisByItself) {
  const double m = 1.5;
  const Vector3 stiffness(300.0, 80.0, 1200.0), damping(0.0, 4.0, 30.0);
  for (int axis = 0; axis < 3; ++axis) {
    ClosureSpec ball;
    ball.stiffness = stiffness;
    ball.damping = damping;
    Vector3 gravity = Vector3::Zero();
    gravity[axis] = kGravity;
    Simulator sim = simulate(tied_ball(m, 0.01, ball, 0.0, gravity));
    expect_oscillator(sim, axis, axis, m, stiffness[axis], damping[axis], m * kGravity, 0.0, 0.0);
  }
}

TEST(Bushing, SwingsWithTheFrequencyOfItsMass) {
  const double m = 1.5, k = 600.0, h = 1e-4, x0 = 0.01;
  ClosureSpec ball;
  ball.stiffness = Vector3::Constant(k);
  Simulator sim = simulate(tied_ball(m, 0.01, ball, 0.0, Vector3::Zero()), h);
  State start = sim.state();
  start.q[0] = x0;
  sim.set_state(start);
  const double omega = std::sqrt(k / m);
  const int quarter = static_cast<int>(std::lround(0.5 * M_PI / omega / h));
  // Backward Euler damps by h omega^2 / 2 and lags by (h omega)^2 / 3 of the phase.
  for (int n = 1; n <= 8 * quarter; ++n) {
    ASSERT_TRUE(sim.step().succeeded());
    const double decay = std::exp(-0.5 * h * omega * omega * n * h);
    ASSERT_NEAR(sim.state().q[0], x0 * decay * std::cos(omega * n * h), 3e-3 * x0) << n;
  }
}

TEST(Bushing, HangsByItsWeightOverItsStiffness) {
  const double m = 2.0, k = 500.0;
  ClosureSpec weld;
  weld.type = ClosureType::kWeld;
  weld.stiffness = Vector3::Constant(k);
  weld.damping = Vector3::Constant(2.0 * std::sqrt(k * m));
  Simulator sim = simulate(tied_ball(m, 0.01, weld));
  double lowest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    lowest = std::min(lowest, sim.state().q[2]);
  }
  const double at_rest = -m * kGravity / k;
  EXPECT_NEAR(sim.state().q[2], at_rest, 1e-9);
  EXPECT_GT(lowest, at_rest - 1e-9);  // critical damping passes no equilibrium
}

TEST(Bushing, TurnsLikeATorsionPendulum) {
  // The linear rows stay rigid; about z a spring, about x and y another one.
  const double inertia = 0.02, k = 0.7, d = 0.01;
  ClosureSpec weld;
  weld.type = ClosureType::kWeld;
  weld.rotational_stiffness = Vector3(5.0, 5.0, k);
  weld.rotational_damping = Vector3(0.1, 0.1, d);
  Simulator sim = simulate(tied_ball(1.0, inertia, weld));
  sim.input().applied_force = VectorX::Zero(6);
  sim.input().applied_force[5] = 0.5;  // [N m], turns by 0.7 rad at rest and twice as far at first
  const double h = sim.options().time_step;
  double angle = 0.0, w = 0.0;
  for (int n = 0; n < 1000; ++n) {
    ASSERT_TRUE(sim.step().succeeded());
    w = (inertia * w + h * (0.5 - k * angle)) / (inertia + h * d + h * h * k);
    angle += h * w;
    ASSERT_NEAR(sim.state().v[5], w, 1e-8) << n;
  }
  EXPECT_LT(sim.state().q.head<3>().norm(), 1e-6);  // the sag of the rigid rows
}

TEST(Bushing, LeavesAnAxisFreeThatHasNoSpring) {
  ClosureSpec weld;
  weld.type = ClosureType::kWeld;
  weld.stiffness = Vector3(100.0, 100.0, 0.0);
  weld.rotational_stiffness = Vector3(10.0, 10.0, 0.0);
  Model model = tied_ball(1.0, 0.01, weld);
  EXPECT_EQ(num_rows(model.closures()[0]), 4);
  Simulator sim = simulate(std::move(model));
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().v[2], -kGravity * sim.state().time, 1e-9);  // rounding of 10 m/s
}

TEST(SpringDistance, HangsLongerByItsWeightOverItsStiffness) {
  const double m = 2.0, k = 400.0, length = 0.5;
  ClosureSpec spring;
  spring.type = ClosureType::kDistance;
  spring.length = length;
  spring.stiffness = Vector3::Constant(k);
  spring.damping = Vector3::Constant(40.0);
  Simulator sim = simulate(tied_ball(m, 0.01, spring, length));
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().q[2], -(length + m * kGravity / k), 1e-9);
}

double total_energy(const Simulator& sim) {
  const Data data = kinematics_of(sim);
  return kinetic_energy(sim.model(), sim.state().v, data) + potential_energy(sim.model(), data) +
         spring_energy(sim.model(), sim.state().q);
}

TEST(SpringDistance, NeverGainsEnergyAsItSwings) {
  // Without damping: what backward Euler takes, and nothing is added, at any stiffness.
  for (const double k : {20.0, 2e3, 2e5}) {
    ClosureSpec spring;
    spring.type = ClosureType::kDistance;
    spring.length = 0.5;
    spring.stiffness = Vector3::Constant(k);
    Simulator sim = simulate(tied_ball(1.0, 0.01, spring, 0.5));
    State start = sim.state();
    start.v[0] = 1.5;
    sim.set_state(start);
    double before = total_energy(sim);
    for (int i = 0; i < 2000; ++i) {
      ASSERT_TRUE(sim.step().succeeded());
      const double now = total_energy(sim);
      // The free part of a step, semi-implicit Euler under gravity, is exact to h^2 g^2 m / 2.
      ASSERT_LT(now - before, 0.5 * std::pow(0.002 * kGravity, 2) + 1e-9) << k << ' ' << i;
      before = now;
    }
  }
}

Simulator on_a_rope(double length, double stiffness, double damping, double h) {
  ClosureSpec rope;
  rope.type = ClosureType::kDistance;
  rope.rope = true;
  rope.length = length;
  if (stiffness > 0.0) rope.stiffness = Vector3::Constant(stiffness);
  if (damping > 0.0) rope.damping = Vector3::Constant(damping);
  return simulate(tied_ball(2.0, 0.01, rope, 0.1), h);
}

TEST(Rope, LetsFallUntilItIsTautAndHoldsThen) {
  const double length = 0.6, h = 0.001;
  Simulator sim = on_a_rope(length, 0.0, 0.0, h);
  State start = sim.state();
  start.v[0] = 1.0;
  sim.set_state(start);
  // Semi-implicit Euler is exact in energy to m (h g)^2 / 2 a step [J], the square of the velocity
  // that a step adds.
  const double kOneStep = 0.5 * 2.0 * std::pow(h * kGravity, 2);
  const double start_energy = total_energy(sim);
  double before = start_energy, longest = 0.0;
  bool taut = false;
  for (int n = 1; n <= 3000; ++n) {
    ASSERT_TRUE(sim.step().succeeded());
    const Vector3 p = sim.state().q.head<3>();
    longest = std::max(longest, p.norm());
    taut = taut || p.norm() > length - 2.0 * h;
    // The force of smoothing at a distance is far below 1e-9 of the weight.
    if (!taut) {
      ASSERT_NEAR(sim.state().v[2], -kGravity * h * n, 1e-9) << n;
      ASSERT_NEAR(sim.state().v[0], 1.0, 1e-9) << n;
    }
    const double now = total_energy(sim);
    ASSERT_LT(now - before, kOneStep) << n;
    ASSERT_LT(now, start_energy + kOneStep) << n;
    before = now;
  }
  EXPECT_TRUE(taut);
  // The curvature is met to third order in h; the sag is 100 eps h^2 g / beta.
  EXPECT_LT(longest, length + 1e-6);
}

TEST(Rope, BungeeStretchesByTheEnergyOfTheFall) {
  const double length = 0.6, k = 300.0, m = 2.0, drop = length - 0.1;
  Simulator sim = on_a_rope(length, k, 0.0, 1e-4);
  double lowest = 0.0;
  for (int n = 0; n < 8000; ++n) {
    ASSERT_TRUE(sim.step().succeeded());
    lowest = std::min(lowest, sim.state().q[2]);
  }
  // m g (drop + x) = k x^2 / 2; backward Euler loses h omega of it in the stretch.
  const double x =
      (m * kGravity + std::sqrt(m * m * kGravity * kGravity + 2.0 * k * m * kGravity * drop)) / k;
  EXPECT_NEAR(-lowest - length, x, 0.01 * x);
}

TEST(Rope, ADamperActsOnlyWhereItIsTaut) {
  const double length = 0.6, h = 0.002;
  Simulator sim = on_a_rope(length, 2000.0, 300.0, h);
  for (int n = 1; sim.state().q[2] > -length + 0.02; ++n) {
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_NEAR(sim.state().v[2], -kGravity * h * n, 1e-9) << n;
  }
  for (int n = 0; n < 3000; ++n) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(-sim.state().q[2], length + 2.0 * kGravity / 2000.0, 1e-9);
}

/// Five free boxes with bushings, spring distances and ropes between them.
Model soft_chain(const Vector3& gravity, const SpatialInertia& inertia) {
  ModelBuilder builder(gravity);
  std::vector<ClosureSpec> closures(4);
  closures[0].stiffness = Vector3(500.0, 900.0, 400.0);
  closures[0].damping = Vector3::Constant(3.0);
  closures[1].type = ClosureType::kWeld;
  closures[1].stiffness = Vector3::Constant(800.0);
  closures[1].rotational_stiffness = Vector3(10.0, 5.0, 8.0);
  closures[1].rotational_damping = Vector3::Constant(0.1);
  closures[2].type = ClosureType::kDistance;
  closures[2].stiffness = Vector3::Constant(300.0);
  closures[2].damping = Vector3::Constant(2.0);
  closures[3].type = ClosureType::kDistance;
  closures[3].rope = true;
  for (int i = 0; i < 5; ++i) {
    RobotSpec robot = test::base_only("box", "body");
    robot.links[0].inertia = inertia;
    Pose start;
    start.translation.x() = 0.3 * i;
    builder.add_robot(robot, Base::kFloating, start, std::to_string(i) + "/");
  }
  for (int i = 0; i < 4; ++i) {
    closures[i].link_a = std::to_string(i) + "/body";
    closures[i].link_b = std::to_string(i + 1) + "/body";
    closures[i].anchor_a = Vector3(0.1, 0.03, 0.0);
    builder.add_closure(closures[i]);
  }
  return builder.build();
}

TEST(ClosureInverse, RecoversForcesOnSpringsAndRopes) {
  test::Random random(6);
  Simulator sim = simulate(soft_chain(
      Vector3(0, 0, -kGravity), solid_inertia({ShapeType::kBox, {0.1, 0.05, 0.15}, nullptr}, 1.0)));
  EXPECT_LT(test::recover(sim, 500, 1.0, random), kRecovered);
}

TEST(Bushing, BetweenFreeBodiesKeepsMomentumAndGainsNoEnergy) {
  Simulator sim =
      simulate(soft_chain(Vector3::Zero(), {1.5, Vector3::Zero(), 0.01 * Matrix3::Identity()}));
  test::set_random_velocities(sim, 1.0);
  const double energy = total_energy(sim);
  test::expect_momentum_kept(sim, [&] { ASSERT_LT(total_energy(sim), energy); });
}

TEST(Bushing, IsRefusedByRungeKutta) {
  Simulator sim =
      simulate(soft_chain(Vector3::Zero(), {1.5, Vector3::Zero(), Matrix3::Identity()}));
  sim.options().integrator = Integrator::kRungeKutta4;
  EXPECT_THROW(sim.step(), InputError);
}

TEST(Bushing, StepAndInverseDoNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim = simulate(soft_chain(
      Vector3(0, 0, -kGravity), solid_inertia({ShapeType::kBox, {0.1, 0.05, 0.15}, nullptr}, 1.0)));
  test::expect_no_allocations(sim, 50);
}

}  // namespace
}  // namespace counterpoint::closure_springs_test
