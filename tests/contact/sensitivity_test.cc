#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact/trials.h"
#include "counterpoint/contact/inverse.h"

namespace counterpoint::contact::sensitivity_test {
namespace {

using testing::for_trials;
using testing::kDifferenceStep;
using testing::kDifferenceTolerance;
using testing::kEveryType;
using testing::Random;
using testing::random_law;
using testing::RandomOptions;

// Distance of y from the nearest branch change of the law.
double distance_to_corners(const Law& law, const Rows& y) {
  double square = 0.0;
  for (int i = 1; i < law.rows; ++i) square += std::pow(law.friction[i - 1] * y[i], 2);
  const double t = std::sqrt(square);
  if (!law.coulomb) return std::min({std::abs(y[0] + t), std::abs(y[0] - t), t});
  const double rho_n = std::max(0.0, -y[0]);  // rho times the normal impulse
  const double held = rho_n + scaled_slip_speed(law);
  return std::min({std::abs(y[0]), std::abs(t - held), t});
}

class SensitivityTest : public ::testing::TestWithParam<bool> {};

TEST_P(SensitivityTest, AgreesWithDifferences) {
  RandomOptions options;
  options.coulomb = GetParam();
  for_trials(1, 4000, [&](Random& random, int trial) {
    Law law = random_law(random, options, kEveryType[trial % 4]);
    law.regularizer = random.log_uniform(0.05, 2.0);
    law.smoothing = random.log_uniform(0.05, 2.0);
    law.bound = random.log_uniform(0.1, 2.0);
    if (law.coulomb && random.coin()) law.slip_speed = random.log_uniform(0.05, 2.0);
    if (law.coulomb && law.type == LawType::kFrictionCone && law.rows >= 3 && random.coin())
      law.lean = {random.signed_unit(), random.signed_unit()};
    for (double& mu : law.friction) {
      // Avoids the corner of rho(mu) at 0.1, where the derivative does not exist.
      if (std::abs(mu - kMinRegularizingFriction) < 0.01 || mu < 2 * kDifferenceStep) mu = 0.5;
    }
    Rows y(law.rows);
    for (int i = 0; i < law.rows; ++i) y[i] = random.signed_unit();
    const Sensitivity at = compute_sensitivity(law, y);
    const auto difference = [&](double Law::*parameter) {
      Law up = law, down = law;
      up.*parameter += kDifferenceStep;
      down.*parameter -= kDifferenceStep;
      return Rows((impulse(up, y) - impulse(down, y)) / (2 * kDifferenceStep));
    };
    const Rows smoothing = difference(&Law::smoothing), regularizer = difference(&Law::regularizer);
    const Rows slip_speed = difference(&Law::slip_speed);
    EXPECT_LT((at.slip_speed - slip_speed).norm(), kDifferenceTolerance * (1 + slip_speed.norm()));
    EXPECT_LT((at.smoothing - smoothing).norm(), kDifferenceTolerance * (1 + smoothing.norm()));
    EXPECT_LT((at.regularizer - regularizer).norm(),
              kDifferenceTolerance * (1 + regularizer.norm()));
    for (int j = 0; j < law.rows - 1 && law.type == LawType::kFrictionCone; ++j) {
      Law up = law, down = law;
      up.friction[j] += kDifferenceStep;
      down.friction[j] -= kDifferenceStep;
      const Rows friction = (impulse(up, y) - impulse(down, y)) / (2 * kDifferenceStep);
      EXPECT_LT((at.friction.col(j) - friction).norm(),
                kDifferenceTolerance * (1 + friction.norm()))
          << j;
    }
    // The derivative by the velocity is minus the Hessian; a gap acts through the bias of the
    // normal row.
    EXPECT_EQ(at.velocity, RowsSquare(-evaluate(law, y).hessian));
  });
}

// Away from its corners the law without smoothing has derivatives, too. The one by the smoothing is
// one-sided and describes how an open contact begins to carry a force.
TEST_P(SensitivityTest, WithoutSmoothingAgreesWithDifferencesOffTheCorners) {
  RandomOptions options;
  options.coulomb = GetParam();
  int tried = 0;
  for_trials(2, 8000, [&](Random& random, int) {
    Law law = random_law(random, options, LawType::kFrictionCone);
    law.regularizer = random.log_uniform(0.05, 2.0);
    for (int i = 0; i < law.rows - 1; ++i) law.friction[i] = random.uniform(0.2, 2.0);
    if (law.coulomb && random.coin()) law.slip_speed = random.log_uniform(0.05, 2.0);
    Rows y(law.rows);
    for (int i = 0; i < law.rows; ++i) y[i] = random.signed_unit();
    if (distance_to_corners(law, y) < 0.1) return;
    ++tried;
    const Sensitivity at = compute_sensitivity(law, y);
    for (int j = 0; j < law.rows; ++j) {
      Rows up = y, down = y;
      up[j] += kDifferenceStep;
      down[j] -= kDifferenceStep;
      const Rows velocity = (impulse(law, up) - impulse(law, down)) / (2 * kDifferenceStep);
      EXPECT_LT((at.velocity.col(j) - velocity).norm(),
                kDifferenceTolerance * (1 + at.velocity.norm()));
    }
    Law up = law, far = law;
    up.smoothing = kDifferenceStep;
    far.smoothing = 2 * kDifferenceStep;
    const Rows smoothing =
        (4 * impulse(up, y) - 3 * impulse(law, y) - impulse(far, y)) / (2 * kDifferenceStep);
    // Third derivatives by k grow as r^2 over the fifth power of the distance to the corners.
    constexpr double kThirdOrder = 1e3;
    EXPECT_LT((at.smoothing - smoothing).norm(),
              kThirdOrder * kDifferenceTolerance * (1 + smoothing.norm()));
    up = law;
    Law down = law;
    up.regularizer += kDifferenceStep;
    down.regularizer -= kDifferenceStep;
    const Rows regularizer = (impulse(up, y) - impulse(down, y)) / (2 * kDifferenceStep);
    EXPECT_LT((at.regularizer - regularizer).norm(),
              kDifferenceTolerance * (1 + regularizer.norm()));
  });
  EXPECT_GT(tried, 3000);
}

INSTANTIATE_TEST_SUITE_P(Friction, SensitivityTest, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "coulomb" : "convex"; });

}  // namespace
}  // namespace counterpoint::contact::sensitivity_test
