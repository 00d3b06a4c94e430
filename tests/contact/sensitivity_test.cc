#include "counterpoint/contact/sensitivity.h"

#include <gtest/gtest.h>

#include "contact/trials.h"

namespace counterpoint::contact {
namespace {

using testing::for_trials;
using testing::kDifferenceStep;
using testing::kDifferenceTolerance;
using testing::kEveryType;
using testing::Random;
using testing::random_law;
using testing::RandomOptions;

class SensitivityTest : public ::testing::TestWithParam<bool> {};

TEST_P(SensitivityTest, AgreesWithDifferences) {
  RandomOptions options;
  options.coulomb = GetParam();
  for_trials(1, 4000, [&](Random& random, int trial) {
    Law law = random_law(random, options, kEveryType[trial % 4]);
    law.regularizer = random.log_uniform(0.05, 2.0);
    law.smoothing = random.log_uniform(0.05, 2.0);
    law.bound = random.log_uniform(0.1, 2.0);
    for (double& mu : law.friction) {
      // Off the corner of rho(mu) at 0.1, where there is no derivative.
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
    // A gap acts through the bias of the normal row.
    EXPECT_EQ(at.velocity, RowsSquare(-evaluate(law, y).hessian));
  });
}

INSTANTIATE_TEST_SUITE_P(Friction, SensitivityTest, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "coulomb" : "convex"; });

}  // namespace
}  // namespace counterpoint::contact
