// The signature test: forward, then inverse, gives back what was applied, whatever was in the way.
#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/engine/simulator.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint {
namespace {

/// The contact solver's relative residual (1e-10), divided by nothing: the force scale is the step's
/// own largest force.
constexpr double kRecovered = 1e-8;
/// Without constraints only round-off is left: v / h against a.
constexpr double kRoundoff = 1e-10;

struct Recovery {
  double error = 0.0;   ///< largest difference over all steps and coordinates
  double scale = 0.0;   ///< largest force
  int contacts = 0, rows = 0;
  double relative() const { return error / scale; }
};

/// Random applied forces, held for ten steps each, for `steps` steps.
Recovery drive(Simulator& sim, int steps, const VectorX& force_scale, test::Random& random) {
  Recovery result;
  for (int i = 0; i < steps; ++i) {
    if (i % 10 == 0)
      sim.input().applied_force =
          force_scale.cwiseProduct(test::random_vector(sim.model().nv(), random.bits()));
    const State before = sim.state();
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << "step " << i << ": " << contact::status_name(report.status)
                                    << ", residual " << report.residual;
    if (!report.succeeded()) break;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
    result.error = std::max(
        result.error, (inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff());
    result.scale = std::max(result.scale, inverse.force_scale);
    result.contacts += report.contacts;
    result.rows += report.constraint_rows;
  }
  return result;
}

class TimeStep : public ::testing::TestWithParam<double> {};

TEST_P(TimeStep, RandomTreesWithoutContact) {
  for (int seed = 0; seed < 20; ++seed) {
    test::Random random(seed);
    test::RandomModelOptions options;
    options.damping = options.armature = seed % 2 == 0;
    Model model = test::make_random_model(seed, options);
    Scene scene{"random", model, test::random_configuration(model, random.bits()),
                test::random_vector(model.nv(), random.bits()), {}};
    scene.options.time_step = GetParam();
    Simulator sim(std::move(scene));
    // 0.1 s: explicit Coriolis forces at 10 ms may whip light links up without bound later on.
    const int steps = static_cast<int>(0.1 / GetParam());
    const Recovery r = drive(sim, steps, VectorX::Ones(model.nv()), random);
    // v / h: the velocity's rounding, magnified by 1 / h, is what the scheme itself allows.
    EXPECT_LT(r.relative(), kRoundoff + 1e-13 / GetParam()) << "seed " << seed;
  }
}

TEST_P(TimeStep, TumblingBoxWithFrictionRestitutionAndContact) {
  for (const FrictionModel friction : {FrictionModel::kConvex, FrictionModel::kLagged}) {
    Scene scene = test::box_on_plane({.restitution = 0.3, .height = 0.01});
    scene.options.time_step = GetParam();
    scene.options.contact.friction_model = friction;
    scene.v << 1.0, 0.3, -1.0, 5.0, -3.0, 2.0;
    Simulator sim(std::move(scene));
    test::Random random(7);
    VectorX force(6);
    force << 10, 10, 10, 1, 1, 1;
    const int steps = std::min(5000, static_cast<int>(2.0 / GetParam()));
    const Recovery r = drive(sim, steps, force, random);
    EXPECT_GT(r.contacts, 0);
    EXPECT_LT(r.relative(), kRecovered);
  }
}

TEST_P(TimeStep, PendulumOnItsLimit) {
  Scene scene = test::pendulum({.damping = 0.1, .lower = -0.5, .upper = 0.5});
  scene.options.time_step = GetParam();
  scene.q[0] = 0.45;
  Simulator sim(std::move(scene));
  test::Random random(3);
  const int steps = static_cast<int>(2.0 / GetParam());
  const Recovery r = drive(sim, steps, VectorX::Constant(1, 40.0), random);
  EXPECT_GT(r.rows, 0);
  EXPECT_LT(r.relative(), kRecovered);
}

INSTANTIATE_TEST_SUITE_P(Steps, TimeStep, ::testing::Values(1e-4, 1e-3, 1e-2));

}  // namespace
}  // namespace counterpoint
