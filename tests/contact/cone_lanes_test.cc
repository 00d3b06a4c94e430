// Evaluating four friction contacts at a time gives the law of each contact.
#include "counterpoint/contact/laws/cone_lanes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::cone_lanes_test {
namespace {

// Parameter: Coulomb or convex. Covers every remainder of a division by four, and velocities and
// laws at branches: at rest, without load, without smoothing.
class Friction : public ::testing::TestWithParam<bool> {};

TEST_P(Friction, OfFourIsTheLawOfEach) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 300; ++trial) {
    const int count = trial % 11;
    FrictionLanes lanes;
    std::vector<Law> laws;
    std::vector<double> y(3 * count), d(3 * count), f(3 * count), hessian(9 * count);
    for (int i = 0; i < count; ++i) {
      Law law;
      law.type = LawType::kFrictionCone;
      law.rows = 3;
      law.coulomb = GetParam();
      law.regularizer = std::pow(10.0, 4.0 * unit(random) - 4.0);
      law.smoothing = random() % 2 == 0 ? 0.0 : std::pow(10.0, 6.0 * unit(random) - 8.0);
      law.slip_speed = random() % 2 == 0 ? 0.0 : std::pow(10.0, 4.0 * unit(random) - 4.0);
      law.friction = {random() % 5 == 0 ? 0.0 : 1.0 + unit(random), 1.0 + unit(random)};
      laws.push_back(law);
      ASSERT_TRUE(lanes.add(law, 1.0, 3 * i, 9 * i));
      for (int r = 0; r < 3; ++r) {
        y[3 * i + r] = random() % 4 == 0 ? 0.0 : unit(random);
        d[3 * i + r] = unit(random);
      }
    }
    lanes.impulses(y.data(), f.data());
    lanes.hessians(y.data(), hessian.data());
    Slope sum, size;
    for (int i = 0; i < count; ++i) {
      double expected[3], expected_hessian[9];
      impulse(laws[i], y.data() + 3 * i, expected);
      for (int r = 0; r < 3; ++r) EXPECT_EQ(f[3 * i + r], expected[r]) << trial << " " << i;
      evaluate(laws[i], y.data() + 3 * i, expected, expected_hessian);
      for (int r = 0; r < 9; ++r)
        EXPECT_EQ(hessian[9 * i + r], expected_hessian[r]) << trial << " " << i << " " << r;
      const Slope s = slope(laws[i], y.data() + 3 * i, d.data() + 3 * i);
      sum.first += s.first;
      sum.second += s.second;
      for (int r = 0; r < 3; ++r) {
        size.first += std::abs(expected[r] * d[3 * i + r]);
        for (int q = 0; q < 3; ++q)
          size.second += std::abs(d[3 * i + r] * expected_hessian[3 * r + q] * d[3 * i + q]);
      }
    }
    Slope slope_sum;
    lanes.add_slope(y.data(), d.data(), slope_sum);
    EXPECT_NEAR(slope_sum.first, sum.first, 1e-14 * size.first) << trial;
    EXPECT_NEAR(slope_sum.second, sum.second, 1e-14 * size.second) << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(FrictionLanes, Friction, ::testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "coulomb" : "convex");
});

}  // namespace
}  // namespace counterpoint::contact::cone_lanes_test
