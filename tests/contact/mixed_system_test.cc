// Linear algebra of the mixed method: its derivative, and LU by blocks.
#include "counterpoint/contact/solve/mixed_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact/trials.h"

namespace counterpoint::contact::mixed_system_test {
namespace {

using testing::any_friction;
using testing::for_islands;
using testing::Random;

// Along Newton's direction d the residual is F(x + t d) = (1 - t) F(x) + O(t^2).
TEST(MixedSystem, DirectionZeroesTheLinearizedResidual) {
  int tried = 0;
  for_islands(31, 300, any_friction, [&](Random& random, const Problem&, IslandSystem& island) {
    MixedSystem system;
    system.begin(island, random.log_uniform(0.1, 3.0));
    system.extra_smoothing = 1.0;  // smooth on the scale of the velocities: small O(t^2)
    MixedSystem::Point point, step;
    point.w.assign(island.free_velocity(), island.free_velocity() + island.size());
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    system.guess(std::vector<double>(island.num_rows(), unknown), point.phi);
    for (double& x : point.phi) x *= 0.7;
    const double before = system.residual(point);
    if (!system.factor()) return;  // a singular derivative is possible for Coulomb laws
    ++tried;
    system.direction(step);
    double square = 0.0;
    for (const double x : step.w) square += x * x;
    for (const double x : step.phi) square += x * x;
    const double t = 1e-6 / (1.0 + std::sqrt(square));
    point.add(t, step);
    const double after = system.residual(point);
    // Second order in t, and the round-off of both norms over t.
    EXPECT_NEAR((before - after) / (t * before), 1.0, 1e-2);
  });
  EXPECT_GT(tried, 200);
}

// Given impulses are returned as phi = inv(D) f; unknown ones are guessed from their own
// constraint.
TEST(MixedSystem, GuessesAreTheImpulsesGiven) {
  for_islands(32, 200, any_friction, [&](Random& random, const Problem&, IslandSystem& island) {
    MixedSystem system;
    system.begin(island, 1.0);
    std::vector<double> f(island.num_rows()), phi;
    for (double& x : f) x = random.signed_unit();
    system.guess(f, phi);
    for (const auto& c : island.constraints()) {
      const bool cone = c.law.type == LawType::kFrictionCone;
      EXPECT_EQ(phi[c.row], f[c.row]);
      for (int r = 1; r < c.law.rows; ++r) {
        const double mu = cone ? c.law.friction[r - 1] : 1.0;
        EXPECT_EQ(phi[c.row + r], mu > 0.0 ? f[c.row + r] / mu : 0.0);
      }
    }
    for (double& x : f) x = std::numeric_limits<double>::quiet_NaN();
    system.guess(f, phi);
    for (const double x : phi) EXPECT_TRUE(std::isfinite(x));
  });
}

}  // namespace
}  // namespace counterpoint::contact::mixed_system_test
