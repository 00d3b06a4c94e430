// Contacts that cannot act in a step have no rows; what is thrown against them gets them in the
// very step, and the inverse tells their forces from the applied ones.
#include "counterpoint/engine/constraints/parked_contacts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/allocation_guard.h"
#include "support/small_scenes.h"

namespace counterpoint {
namespace {

/// The solver's relative residual (1e-10), as in inverse_test.cc.
constexpr double kRecovered = 1e-8;
constexpr double kStep = 0.01;

/// A box above the ground: a candidate at any height below the margin of 10 mm.
Scene box_at(double height, double smoothing = 1e-13) {
  Scene scene = test::box_on_plane({.height = height});
  scene.options.time_step = kStep;
  scene.options.contact.smoothing = smoothing;
  return scene;
}

TEST(ParkedContacts, HaveNoRowsWhereTheyStayOpen) {
  Simulator sim(box_at(8e-3));
  const double gap = parking_gap(sim.options().contact, kStep);
  ASSERT_LT(gap, 4e-3);
  const StepReport report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.constraint_rows, 0);
  EXPECT_EQ(report.newton_iterations, 0);
  EXPECT_EQ(Simulator(box_at(0.5 * gap)).step().constraint_rows, 12);
}

// Smoothing that gives force at a distance: k / gap, 1e-3 m of the weight over 8e-3 m and more.
TEST(ParkedContacts, AreNoneWhereSmoothingActsAcrossTheGap) {
  EXPECT_EQ(Simulator(box_at(8e-3, 1e-3)).step().constraint_rows, 12);
}

TEST(ParkedContacts, HoldWhatIsThrownAgainstThemInOneStepAndAreInverted) {
  for (const double height : {3e-3, 6e-3, 9e-3}) {
    for (const double way : {0.5, 0.95, 1.05, 2.0, 100.0}) {
      Simulator sim(box_at(height));
      const State before = sim.state();
      sim.input().applied_force[2] = -way * height / (kStep * kStep);
      sim.input().applied_force[0] = 20.0;
      sim.input().applied_force[4] = 0.3;
      ASSERT_TRUE(sim.step().succeeded());
      const double yields =
          kStep * sim.options().contact.compliance * std::abs(sim.input().applied_force[2]);
      if (way > 1.5) {
        EXPECT_NEAR(sim.state().q[2] - before.q[2], -height, 1e-4 + yields);
      }
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      const VectorX error = inverse.applied_force - sim.input().applied_force;
      EXPECT_LE(error.cwiseAbs().maxCoeff(), kRecovered * inverse.force_scale)
          << "height " << height << " way " << way;
    }
  }
}

// The lowest corner, of a box that is thrown down while it tilts: no corner ends below the ground.
TEST(ParkedContacts, NoCornerIsPassedOver) {
  for (int i = 0; i < 40; ++i) {
    Scene scene = box_at(9e-3);
    Simulator sim(std::move(scene));
    sim.input().applied_force[2] = -20.0 * i;
    sim.input().applied_force[3] = 0.4 * (i % 7 - 3);
    sim.input().applied_force[4] = 0.4 * (i % 5 - 2);
    ASSERT_TRUE(sim.step().succeeded());
    sim.input().applied_force.setZero();
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded());
    // Turning within a step, (h w)^2 / 2 of the half length, is all that it may be off by.
    const double angle = kStep * sim.state().v.segment<3>(3).norm();
    EXPECT_LE(report.max_penetration, 0.1 * angle * angle + 1e-6) << i;
  }
}

TEST(ParkedContacts, StepsThatAreSolvedAgainDoNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim(box_at(9e-3));
  const State start = sim.state();
  sim.input().applied_force[2] = -300.0;
  for (int i = 0; i < 3; ++i) {
    sim.set_state(start);
    const std::size_t before = test::allocation_count();
    const StepReport report = sim.step();
    const std::size_t after = test::allocation_count();
    ASSERT_TRUE(report.succeeded());
    EXPECT_EQ(report.constraint_rows, 12);
    if (i > 1) {  // once both states have seen the sizes
      EXPECT_EQ(after, before);
    }
  }
}

}  // namespace
}  // namespace counterpoint
