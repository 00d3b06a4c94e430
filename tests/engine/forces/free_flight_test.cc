// Single free bodies: EulerTop, exact at any step, and the free flight that uses it.
#include "counterpoint/engine/forces/free_flight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/euler_top.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "support/linkages.h"
#include "support/random_model.h"

namespace counterpoint::free_flight_test {
namespace {

Vector3 runge_kutta(const Matrix3& inertia, Vector3 w, double duration, int steps) {
  const Matrix3 inverse = inertia.inverse();
  const auto rate = [&](const Vector3& x) -> Vector3 { return -(inverse * x.cross(inertia * x)); };
  const double h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    const Vector3 a = rate(w), b = rate(w + 0.5 * h * a), c = rate(w + 0.5 * h * b);
    w += h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(w + h * c));
  }
  return w;
}

TEST(EulerTop, SolvesEulersEquations) {
  test::Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3 inertia = test::random_inertia(random).rotational;
    const Vector3 w = random.vector(1.0);
    const double h = 2.0 * random.uniform(0.0, 1.0);
    // Runge-Kutta with 4000 steps: a relative error of (|w| h / 4000)^4, below 1e-9 for |w| h < 20.
    // Rounding of either grows by at most e^10 where a body turns about its middle axis.
    EXPECT_LT((EulerTop(inertia).advance(w, h) - runge_kutta(inertia, w, h, 4000)).norm(),
              1e-9 * (1.0 + w.norm()))
        << trial;
  }
}

TEST(EulerTop, KeepsEnergyAndMomentumHoweverLargeTheStep) {
  test::Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const Matrix3 inertia = test::random_inertia(random).rotational;
    const Vector3 w = std::pow(10.0, trial % 7) * random.vector(1.0);
    const Vector3 turned = EulerTop(inertia).advance(w, 0.002);
    // About thirty operations on numbers of one size, times a condition of 10 by the moments; 1e3
    // times more near the middle axis, where D is a small difference.
    constexpr double kRounding = 1e-12;
    EXPECT_NEAR(turned.dot(inertia * turned) / w.dot(inertia * w), 1.0, kRounding) << trial;
    EXPECT_NEAR((inertia * turned).norm() / (inertia * w).norm(), 1.0, kRounding) << trial;
  }
}

TEST(EulerTop, TwoHalvesAreAWhole) {
  test::Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const EulerTop top(test::random_inertia(random).rotational);
    const Vector3 w = 10.0 * random.vector(1.0);
    const Vector3 halves = top.advance(top.advance(w, 0.05), 0.05);
    // Rounding, which a turn of up to two radians about the middle axis may amplify by e^2.
    EXPECT_LT((halves - top.advance(w, 0.1)).norm(), 1e-11 * w.norm()) << trial;
  }
}

TEST(EulerTop, SymmetricBodiesAndSteadyTurns) {
  const Vector3 w(1, -2, 3);
  const EulerTop sphere(0.3 * Matrix3::Identity());
  EXPECT_EQ(sphere.advance(w, 0.1), w) << "to the bit";
  // Every body turns steadily about each of its principal axes, the middle one included.
  const EulerTop box(Vector3(1, 2, 2.5).asDiagonal());
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_EQ(box.advance(Vector3(4.0 * Vector3::Unit(axis)), 0.1), 4.0 * Vector3::Unit(axis));
  // Disk: the angular velocity precesses about the axis at (C/A - 1) w3.
  const double A = 1.0, C = 1.9, h = 0.2;
  const Vector3 turned = EulerTop(Vector3(A, A, C).asDiagonal()).advance(w, h);
  const double angle = (C / A - 1.0) * w[2] * h;
  const Vector3 expected(w[0] * std::cos(angle) - w[1] * std::sin(angle),
                         w[0] * std::sin(angle) + w[1] * std::cos(angle), w[2]);
  EXPECT_LT((turned - expected).norm(), 1e-14);
  // Nearly a sphere, nearly a disk: no division by the difference of the moments.
  for (const double off : {1e-4, 1e-8, 1e-12, 1e-15}) {
    const Vector3 near = EulerTop(Vector3(A, A * (1 + off), C).asDiagonal()).advance(w, h);
    EXPECT_LT((near - expected).norm(), 1e-13 + 10.0 * off) << off;
    EXPECT_LT((EulerTop(Vector3(1, 1 + off, 1 + 2 * off).asDiagonal()).advance(w, h) - w).norm(),
              1e-15 + 10.0 * off)
        << off;
  }
}

TEST(JacobiFunctions, KnownValues) {
  // m = 0: circular; m = 1: hyperbolic.
  EXPECT_NEAR(jacobi_functions(0.7, 1.0).sn, std::sin(0.7), 1e-15);
  EXPECT_NEAR(jacobi_functions(0.7, 0.0).sn, std::tanh(0.7), 1e-15);
  // A quarter period of m = 1/2, K = 1.8540746773013719: sn 1, cn 0, dn sqrt(1/2).
  const JacobiFunctions quarter = jacobi_functions(1.8540746773013719, 0.5);
  EXPECT_NEAR(quarter.sn, 1.0, 1e-15);
  EXPECT_NEAR(quarter.cn, 0.0, 1e-15);
  EXPECT_NEAR(quarter.dn, std::sqrt(0.5), 1e-15);
  // Abramowitz & Stegun, example 16.22: sn(0.20 | 0.81) = 0.19762.
  EXPECT_NEAR(jacobi_functions(0.2, 0.19).sn, 0.19762, 5e-6);
}

/// One free body of random inertia, its frame origin off its centre of mass, without gravity.
Simulator free_body(int seed, double spin) {
  test::Random random(seed);
  RobotSpec robot;
  robot.name = "body";
  LinkSpec link;
  link.name = "body";
  link.inertia = test::random_inertia(random);
  robot.links.push_back(link);
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFloating, Pose(), "");
  Simulator sim = test::simulate(builder.build());
  State state = sim.state();
  state.v.head<3>() = random.vector(1.0);
  state.v.tail<3>() = random.vector(spin);
  sim.set_state(state);
  return sim;
}

struct Conserved {
  Vector3 linear;
  double angular, energy;
};

Conserved conserved(const Simulator& sim) {
  const Data data = test::kinematics_of(sim);
  const Force momentum = total_momentum(sim.model(), data);
  const SpatialInertia& inertia = sim.model().body(1).inertia;
  const Vector3 center = data.X_WB[1] * inertia.center;
  return {momentum.force, (momentum.torque - center.cross(momentum.force)).norm(),
          kinetic_energy(sim.model(), sim.state().v, data)};
}

TEST(FreeFlight, KeepsMomentumAndEnergyAtAnySpin) {
  for (const double spin : {1.0, 1e2, 1e4}) {
    for (int seed = 1; seed <= 10; ++seed) {
      Simulator sim = free_body(seed, spin);
      const Conserved before = conserved(sim);
      for (int i = 0; i < 1000; ++i) ASSERT_TRUE(sim.step().succeeded());
      const Conserved after = conserved(sim);
      // Rounding of 1000 steps: about 1e-15 of the spin each, times the condition of M (100: arms
      // to the centre of mass are longer than the radii of gyration).
      constexpr double kRounding = 1e-10;
      const double mass = sim.model().body(1).inertia.mass;
      EXPECT_LT((after.linear - before.linear).norm(), kRounding * mass * (1.0 + spin)) << seed;
      EXPECT_NEAR(after.angular / before.angular, 1.0, kRounding) << seed;
      EXPECT_NEAR(after.energy / before.energy, 1.0, kRounding) << seed;
    }
  }
}

TEST(FreeFlight, TheInverseFindsNothingApplied) {
  for (int seed = 1; seed <= 10; ++seed) {
    Simulator sim = free_body(seed, 1e3);
    for (int i = 0; i < 100; ++i) {
      const VectorX q = sim.state().q, v = sim.state().v;
      ASSERT_TRUE(sim.step().succeeded());
      const Inverse& inverse = sim.inverse(q, v, sim.state().v);
      // Rounding of the velocities times the mass (arms are below a metre), over h.
      const double rounding = 1e-14 * sim.model().body(1).inertia.mass * v.cwiseAbs().maxCoeff() /
                              sim.options().time_step;
      EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), rounding) << seed;
    }
  }
}

}  // namespace
}  // namespace counterpoint::free_flight_test
