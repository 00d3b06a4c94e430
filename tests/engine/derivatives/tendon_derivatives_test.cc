// Derivatives of the inverse step with tendons, against differences.
#include <gtest/gtest.h>

#include "support/step_derivatives.h"

namespace counterpoint::tendon_derivatives_test {
namespace {

test::RandomModelOptions random_options(int seed) {
  test::RandomModelOptions o;
  o.links = 2 + seed % 6;
  o.base = seed % 2 == 0 ? Base::kFixed : Base::kFloating;
  o.fixed_share = 0.0;
  o.tendons = 1 + seed % 4;
  o.tendon_friction = seed % 4 >= 2;
  o.tendon_limits = seed % 3 == 1;
  o.limits = seed % 5 == 1;
  o.damping = seed % 3 == 0;
  return o;
}

/// The number of steps of random tendons whose derivatives agree with differences; those with a
/// kink within the difference (a bound of a servo, a path that begins to touch) are left out.
int count_exact(Integrator integrator) {
  int checked = 0;
  for (int seed = 0; seed < 40; ++seed) {
    test::Random random(300 + seed);
    Scene scene =
        test::make_random_scene(static_cast<std::uint64_t>(seed), random_options(seed), random);
    test::soften(scene);
    scene.options.integrator = integrator;
    Input input;
    const auto n = static_cast<int>(scene.model.tendons().size());
    input.tendon_force = test::random_vector(n, 50 + static_cast<std::uint64_t>(seed));
    const test::Moment at = test::step_moment(scene, input);
    if (!test::is_smooth(scene, at, 1e-5)) continue;
    ++checked;
    test::expect_exact(scene, at, "seed " + std::to_string(seed),
                       integrator != Integrator::kSemiImplicitEuler, 1e-5);
  }
  return checked;
}

TEST(TendonDerivatives, AreExact) { EXPECT_GT(count_exact(Integrator::kSemiImplicitEuler), 30); }
TEST(TendonDerivatives, AreExactUnderTheMidpointRule) {
  EXPECT_GT(count_exact(Integrator::kImplicitMidpoint), 30);
}

}  // namespace
}  // namespace counterpoint::tendon_derivatives_test
