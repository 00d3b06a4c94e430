// Sines and cosines of joint angles against the long double functions of the C library.
#include "counterpoint/engine/dynamics/sin_cos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "support/random_model.h"

namespace counterpoint::sin_cos_test {
namespace {

/// Error in units in the last place of the exact value.
double error(double value, long double exact) {
  const double size = std::abs(static_cast<double>(exact));
  const double unit = std::nextafter(size, std::numeric_limits<double>::infinity()) - size;
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact)) / unit;
}

/// Half a unit for the last rounding, half for earlier ones, a tenth for the tail of the reduced
/// angle.
constexpr double kUnits = 1.1;

TEST(SinCos, IsRightToTheLastPlaceAtEverySizeOfTheAngle) {
  test::Random random(7);
  for (const double size : {1e-8, 1.0, 4.0, 100.0, kMaxReducedAngle}) {
    double worst = 0.0;
    for (int i = 0; i < 20000; ++i) {
      double x = random.uniform(-size, size);
      // Every third angle is near a multiple of pi / 2: one result is nearly zero, and the argument
      // reduction must be exact.
      if (i % 3 == 0) x = std::nearbyint(x / (0.5 * std::numbers::pi)) * (0.5 * std::numbers::pi);
      double s = 0.0, c = 0.0;
      sin_cos(x, s, c);
      worst = std::max({worst, error(s, std::sin(static_cast<long double>(x))),
                        error(c, std::cos(static_cast<long double>(x)))});
    }
    EXPECT_LT(worst, kUnits) << "angles up to " << size;
  }
}

TEST(SinCos, TakesTheLibrarysBeyondItsReach) {
  for (const double x : {1e6, -3e15, std::numeric_limits<double>::max()}) {
    double s = 0.0, c = 0.0;
    sin_cos(x, s, c);
    EXPECT_EQ(s, std::sin(x));
    EXPECT_EQ(c, std::cos(x));
  }
  double s = 0.0, c = 0.0;
  sin_cos(std::numeric_limits<double>::quiet_NaN(), s, c);
  EXPECT_TRUE(std::isnan(s) && std::isnan(c));
}

}  // namespace
}  // namespace counterpoint::sin_cos_test
