// A leg that stands by its muscles: data/scenes/muscle_leg.yaml.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/recover.h"

namespace counterpoint::muscle_leg_test {
namespace {

constexpr int kHeight = 0;  // the coordinate of the slider [m]
constexpr double kWeight = 35.2 * 9.81;

Simulator leg() {
  return Simulator(load_scene(test::source_dir() + "/data/scenes/muscle_leg.yaml"));
}

double vertical_contact_force(Simulator& sim) {
  double sum = 0.0;
  for (const RememberedForce& f : sim.state().memory)
    if (f.kind == RememberedForce::Kind::kContact) sum += f.force.z();
  return std::abs(sum);
}

// The excitations balance the start to their rounding: 0.1 mm of a tendon is 0.3 N m at the knee,
// which a stiffness of 45 N m/rad answers with 0.7 mm of height.
TEST(MuscleLeg, StandsOnConstantExcitations) {
  Simulator sim = leg();
  double lowest = 0.0, highest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(sim.step().succeeded()) << "step " << i;
    lowest = std::min(lowest, sim.state().q[kHeight]);
    highest = std::max(highest, sim.state().q[kHeight]);
  }
  EXPECT_GT(lowest, -0.001);
  EXPECT_LT(highest, 0.001);
  EXPECT_LT(sim.state().v.norm(), 1e-5) << "at rest";
  EXPECT_NEAR(vertical_contact_force(sim), kWeight, 1e-3 * kWeight);
}

TEST(MuscleLeg, CollapsesWithoutThem) {
  Simulator sim = leg();
  sim.input().command = VectorX::Zero(8);
  for (int i = 0; i < 600; ++i) ASSERT_TRUE(sim.step().succeeded()) << "step " << i;
  EXPECT_LT(sim.state().q[kHeight], -0.1);
}

TEST(MuscleLeg, ReturnsAfterAPush) {
  Simulator sim = leg();
  sim.input().applied_force = VectorX::Zero(4);
  double lowest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    sim.input().applied_force[kHeight] = i < 200 ? -60.0 : 0.0;  // N
    ASSERT_TRUE(sim.step().succeeded()) << "step " << i;
    lowest = std::min(lowest, sim.state().q[kHeight]);
  }
  EXPECT_LT(lowest, -0.003) << "the push is felt";
  EXPECT_NEAR(sim.state().q[kHeight], 0.0, 0.001);
}

// Pushes of up to 1 N and 1 N m move it by up to 0.02 rad/s. Rounding of velocities at the contacts
// grows with the pushes and with 1 / h: at 5 N the forces come back to 2e-9.
TEST(MuscleLeg, InverseReturnsTheAppliedForces) {
  for (const double push : {0.0, 1.0}) {
    Simulator sim = leg();
    test::Random random(1);
    EXPECT_LT(test::recover(sim, 2000, push, random), test::kRecovered) << push << " N";
  }
}

}  // namespace
}  // namespace counterpoint::muscle_leg_test
