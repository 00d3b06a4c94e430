// A limit holds a joint against any force, even if it comes from far away within one step, and the
// inverse tells the limit's force from the applied one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "support/small_scenes.h"

namespace counterpoint::joint_limits_test {
namespace {

/// A limit yields by h times compliance times the speed that it stops; a quarter more for the bias
/// that smoothing leaves.
constexpr double kYields = 1.25;
/// The solver's relative residual (1e-10), as in inverse_test.cc.
constexpr double kRecovered = 1e-8;

struct Throw {
  Integrator integrator;
  double dry_friction;  ///< [N m]; above 0 its row comes before the limit's
  double side;          ///< sign of the limit
};

class ThrownAtALimit : public ::testing::TestWithParam<Throw> {};

TEST_P(ThrownAtALimit, FromFarInOneStepItIsHeldAndInverted) {
  const auto& [integrator, dry_friction, side] = GetParam();
  for (const double h : {1e-4, 1e-3, 0.01, 0.05}) {
    for (const double way : {0.2, 0.5, 0.999, 1.001, 1.5, 10.0}) {
      Scene scene = test::pendulum({.dry_friction = dry_friction, .lower = -1.0, .upper = 1.0});
      scene.options.time_step = h;
      scene.options.integrator = integrator;
      scene.q[0] = 0.0;
      Simulator sim(std::move(scene));
      // From rest in the middle, over `way` of the distance to the limit in a step: I = m l^2 = 1.
      const double speed = side * way / h;
      sim.input().applied_force[0] = speed / h + (side > 0 ? dry_friction : -dry_friction);
      const State before = sim.state();
      const StepReport report = sim.step();
      ASSERT_TRUE(report.succeeded());
      const double overrun = std::abs(sim.state().q[0]) - 1.0;
      const double yields = kYields * h * sim.options().contact.compliance * std::abs(speed);
      EXPECT_LE(overrun, yields) << "h " << h << " way " << way;
      if (way > 1.0 && integrator == Integrator::kSemiImplicitEuler) {
        EXPECT_GE(overrun, -1e-9) << "it gets there; h " << h << " way " << way;
      }
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().q, sim.state().v);
      const double applied = sim.input().applied_force[0];
      EXPECT_NEAR(inverse.applied_force[0], applied, kRecovered * std::abs(applied))
          << "h " << h << " way " << way;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Throws, ThrownAtALimit,
                         ::testing::Values(Throw{Integrator::kSemiImplicitEuler, 0.0, 1.0},
                                           Throw{Integrator::kSemiImplicitEuler, 0.0, -1.0},
                                           Throw{Integrator::kSemiImplicitEuler, 3.0, 1.0},
                                           Throw{Integrator::kImplicitMidpoint, 0.0, 1.0},
                                           Throw{Integrator::kImplicitMidpoint, 0.0, -1.0},
                                           Throw{Integrator::kImplicitMidpoint, 3.0, -1.0}));

TEST(JointLimits, FarFromThemAStepHasNoRows) {
  Simulator sim(test::pendulum({.lower = -1.0, .upper = 1.0}));
  sim.input().applied_force[0] = 0.5;
  ASSERT_TRUE(sim.step().succeeded());
  const StepReport report = sim.step();
  EXPECT_EQ(report.constraint_rows, 0);
  EXPECT_EQ(report.newton_iterations, 0);
}

// Without q after the step the midpoint inverse lacks information and throws.
TEST(JointLimits, TheMidpointsInverseAsksForTheEnd) {
  Scene scene = test::pendulum({.lower = -1.0, .upper = 1.0});
  scene.options.integrator = Integrator::kImplicitMidpoint;
  scene.q[0] = 0.0;
  Simulator sim(std::move(scene));
  sim.input().applied_force[0] = 3.0 / std::pow(sim.options().time_step, 2);
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_THROW(sim.inverse(before.q, before.v, sim.state().v), InputError);
}

}  // namespace
}  // namespace counterpoint::joint_limits_test
