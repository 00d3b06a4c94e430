// Closures under runge_kutta_4: singular poses, order four, energy.
#include "counterpoint/engine/step/equality_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/allocation_guard.h"
#include "support/linkages.h"

namespace counterpoint::equality_motion_test {
namespace {

/// A parallelogram of rods of 1 m and 1 kg with upright cranks that turn at `speed` [rad/s]. It is
/// flat twice a turn, where its closure loses rank and it could fold the other way.
Simulator window(double speed, double time_step, Integrator integrator, double stiffness = 0.0) {
  RobotSpec robot = test::base_only("window", "frame");
  const Vector3 y = Vector3::UnitY(), up = Vector3::UnitZ(), right = Vector3::UnitX();
  test::add_rod(robot, "left", "frame", "j0", Vector3::Zero(), up, y);
  test::add_rod(robot, "top", "left", "j1", up, right, y);
  test::add_rod(robot, "right", "top", "j2", right, -up, y);
  robot.joints[1].stiffness = stiffness;
  ModelBuilder builder(Vector3(0, 0, -9.81));
  builder.add_robot(robot, Base::kFixed, Pose());
  ClosureSpec pivot;
  pivot.link_a = "right";
  pivot.link_b = "world";
  pivot.anchor_a = -up;
  builder.add_closure(pivot);
  Simulator sim = test::simulate(builder.build(), time_step);
  sim.options().integrator = integrator;
  State state = sim.state();
  state.v << speed, -speed, speed;
  sim.set_state(state);
  return sim;
}

struct Worst {
  double energy = 0.0, open = 0.0;
};
double energy(const Simulator& sim) {
  double sum = test::energy(sim).total();
  for (const JointSpring& spring : sim.model().springs()) {
    const double q = sim.state().q[sim.model().body(spring.joint + 1).q_index];
    sum += 0.5 * spring.stiffness * (q - spring.reference) * (q - spring.reference);
  }
  return sum;
}
Worst run(Simulator& sim, double duration) {
  Worst worst;
  const double start = energy(sim);
  const long steps = std::lround(duration / sim.options().time_step);
  for (long i = 0; i < steps; ++i) {
    EXPECT_TRUE(sim.step().succeeded()) << i;
    worst.energy = std::max(worst.energy, std::abs(energy(sim) - start));
    worst.open = std::max(worst.open, test::open_by(sim));
  }
  return worst;
}

TEST(RungeKuttaUnderEqualities, KeepsEnergyThroughFlatPoses) {
  // Five turns in 10 s, 20.5 J.
  struct Case {
    double h, energy;  // [s], [J]
  };
  for (const auto& [h, energy] : {Case{1e-3, 1e-6}, Case{2e-3, 1e-6}, Case{1e-2, 1e-4}}) {
    Simulator sim = window(1.0, h, Integrator::kRungeKutta4);
    const Worst worst = run(sim, 10.0);
    EXPECT_LT(worst.energy, energy) << h;
    EXPECT_LT(worst.open, 1e-12) << h;
    EXPECT_GT(sim.state().q[0], 30.0) << h;  // it turned over
  }
}

TEST(RungeKuttaUnderEqualities, KeepsEnergyBesideAStiffSpring) {
  // omega = sqrt(k / (5/3 kg m^2)) = 134/s: an explicit method of order four loses a share of
  // (omega h)^6 / 72 of the energy a step, 1.6e-4 of 0.8 J in 2 s.
  Simulator sim = window(1.0, 1e-3, Integrator::kRungeKutta4, 3e4);
  const Worst worst = run(sim, 2.0);
  EXPECT_LT(worst.energy, 2e-4);
  EXPECT_LT(worst.open, 1e-12);
}

TEST(RungeKuttaUnderEqualities, IsOfOrderFour) {
  const auto end = [](double h) {
    Simulator sim = window(3.0, h, Integrator::kRungeKutta4);
    run(sim, 0.48);
    return sim.state();
  };
  const State exact = end(2.5e-4), coarse = end(8e-3), fine = end(4e-3);
  const double of_coarse = (coarse.q - exact.q).norm() + (coarse.v - exact.v).norm();
  const double of_fine = (fine.q - exact.q).norm() + (fine.v - exact.v).norm();
  EXPECT_GT(std::log2(of_coarse / of_fine), 3.7);
  EXPECT_LT(std::log2(of_coarse / of_fine), 5.0);
}

TEST(RungeKuttaUnderEqualities, ClosesWhatStartsOpenNoFasterThanItMay) {
  Simulator sim = window(0.0, 2e-3, Integrator::kRungeKutta4);
  State state = sim.state();
  state.q[2] += 0.02;  // 20 mm
  sim.set_state(state);
  double last = test::open_by(sim);
  EXPECT_GT(last, 0.019);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    const double now = test::open_by(sim);
    // 1 m/s, and terms of second order.
    EXPECT_GT(now, last - 1.1 * 2e-3);
    last = now;
  }
  EXPECT_LT(last, 1e-12);
}

TEST(RungeKuttaUnderEqualities, StepsDoNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim = window(1.0, 2e-3, Integrator::kRungeKutta4);
  for (int i = 0; i < 10; ++i) sim.step();
  const std::size_t before = test::allocation_count();
  for (int i = 0; i < 100; ++i) sim.step();
  EXPECT_EQ(test::allocation_count() - before, 0u);
}

}  // namespace
}  // namespace counterpoint::equality_motion_test
