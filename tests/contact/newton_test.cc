// Newton's method on velocities, tested alone.
#include "counterpoint/contact/solve/newton.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "contact/rounding.h"
#include "contact/trials.h"

namespace counterpoint::contact::newton_test {
namespace {

using testing::Cost;
using testing::cost_of;
using testing::for_islands;
using testing::for_trials;
using testing::Random;
using testing::RandomOptions;

RandomOptions convex(Random& random) {
  RandomOptions options;
  options.hard = random.coin();
  return options;
}

// The cost decreases at every iterate; it is recomputed from the problem.
TEST(Newton, CostOfConvexProblemsFallsMonotonically) {
  Newton newton;
  int steps = 0, resolved = 0;
  for_islands(4, 500, convex, [&](Random&, const Problem& problem, IslandSystem& island) {
    std::vector<double> w(island.size(), 0.0), f(island.num_rows());
    newton.begin(island);
    Cost last = cost_of(problem, VectorX::Zero(island.size()));
    constexpr int kMostSteps = 30;
    for (int i = 1; i <= kMostSteps; ++i) {
      if (newton.run(Settings{}.tolerance, 1, w, f).iterations == 0) break;
      const Cost cost = cost_of(problem, Eigen::Map<const VectorX>(w.data(), island.size()));
      ++steps;
      if (last.value - cost.value > last.rounding + cost.rounding) ++resolved;
      EXPECT_LE(cost.value, last.value + last.rounding + cost.rounding)
          << "step " << i << " rises by " << cost.value - last.value;
      last = cost;
    }
  });
  EXPECT_GT(steps, 1000);
  EXPECT_GT(resolved, steps / 2);  // otherwise the round-off bound would hide an increase
}

// A slightly perturbed solution is found again with the old factors. Bad factors, those of M alone,
// lead to the same solution.
TEST(Newton, OldFactorsAreUsedWhereTheyServe) {
  Newton newton;
  int solved = 0, without_new = 0, misled = 0;
  for_islands(6, 500, convex, [&](Random& random, const Problem&, IslandSystem& island) {
    std::vector<double> w(island.size(), 0.0), f(island.num_rows());
    const double tolerance = Settings{}.tolerance;
    constexpr int kMostSteps = 100;
    newton.begin(island);
    if (newton.run(tolerance, kMostSteps, w, f).iterations < 2) return;
    ++solved;
    constexpr double kMoved = 1e-9, kExpected = 1e-3, kBlindly = 0.0;
    std::vector<double> again = w;
    for (double& x : again) x += kMoved * random.signed_unit();
    const Newton::Result near = newton.run(tolerance, kMostSteps, again, f, kExpected);
    EXPECT_TRUE(succeeded(near.status));
    if (near.iterations == 0) ++without_new;

    ASSERT_TRUE(island.factor(std::vector<double>(island.hessian_size(), 0.0).data(), false));
    std::vector<double> other(island.size(), 0.0);
    const Newton::Result far = newton.run(tolerance, kMostSteps, other, f, kBlindly);
    EXPECT_TRUE(succeeded(far.status));
    if (far.iterations > 0) ++misled;
    const Eigen::Map<const VectorX> one(w.data(), island.size()), two(other.data(), island.size());
    const double error = (two - one).lpNorm<Eigen::Infinity>();
    const double size = one.lpNorm<Eigen::Infinity>();
    constexpr double kSame = 1e-10;  // velocity error for impulses exact to 1e-12
    EXPECT_LE(error, kSame * (1.0 + size));
  });
  EXPECT_GT(solved, 200);
  EXPECT_GT(without_new, solved / 2);
  EXPECT_GT(misled, solved / 2);
}

// Sums of smoothed steps, some with the width ratio of the softest and hardest laws. Newton steps
// alone approach such a step slowly from one side.
TEST(LineSearch, FindsTheZeroOfEverySumOfSmoothedSteps) {
  for_trials(5, 5000, [&](Random& random, int) {
    constexpr int kSteps = 6;
    double place[kSteps], height[kSteps], width[kSteps];
    for (int i = 0; i < kSteps; ++i) {
      place[i] = random.uniform(0.0, 1.0);
      height[i] = random.log_uniform(1e-3, 1e3);
      width[i] = random.log_uniform(1e-9, 1.0);
    }
    const auto derivative = [&](double alpha) {
      Slope out{-1.0 + 1e-2 * alpha, 1e-2};
      for (int i = 0; i < kSteps; ++i) {
        const double x = alpha - place[i], root = std::hypot(x, width[i]);
        out.first += height[i] * (x / root + place[i] / std::hypot(place[i], width[i]));
        out.second += height[i] * width[i] * width[i] / (root * root * root);
      }
      return out;
    };
    constexpr double kAccuracy = 0.1;  // line search accuracy of Newton's method
    const LineSearchResult result = search_line(derivative, -1.0, kAccuracy);
    EXPECT_TRUE(result.found);
    EXPECT_LE(std::abs(derivative(result.step).first), kAccuracy);
  });
}

}  // namespace
}  // namespace counterpoint::contact::newton_test
