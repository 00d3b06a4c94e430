// Errors of readings: bias, noise, rounding, rate and delay.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/sensors/white_noise.h"
#include "engine/sensors/sensed.h"
#include "support/arm_spec.h"

namespace counterpoint::sensor_readings_test {
namespace {

Model model_with(const std::vector<SensorErrors>& errors) {
  ModelBuilder builder;
  builder.add_robot(test::make_arm(), Base::kFixed, Pose());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    SensorSpec one;
    one.sensor.name = "q" + std::to_string(i);
    one.sensor.kinds = {SensorKind::kJointPosition};
    one.sensor.errors = errors[i];
    one.joint = "elbow";
    builder.add_sensor(one);
  }
  return builder.build();
}

/// Readings of one sensor over rows `h` [s] apart whose exact value is `value(time)`.
template <class Value>
std::vector<double> read(const SensorErrors& errors, std::uint64_t seed, int rows, double h,
                         const Value& value) {
  const Model model = model_with({errors});
  SensorSampler readings(model, seed);
  std::vector<double> out;
  for (int i = 0; i < rows; ++i) {
    VectorX row(1);
    readings.read(i * h, VectorX::Constant(1, value(i * h)), row);
    out.push_back(row[0]);
  }
  return out;
}

const auto time_itself = [](double t) { return t; };
const auto zero = [](double) { return 0.0; };

TEST(SensorReadings, WithoutErrorsAreTheExactValues) {
  const auto rows = read({}, 3, 100, 0.002, time_itself);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(rows[static_cast<std::size_t>(i)], 0.002 * i);
}

TEST(SensorReadings, NoiseHasMeanZeroItsVarianceAndTheTailsOfANormalDistribution) {
  const int rows = 200000;
  const double deviation = 0.3;
  const auto noise = read({{}, {deviation}, {}, 0, 0}, 7, rows, 1e-3, zero);
  double mean = 0.0, variance = 0.0, fourth = 0.0, neighbours = 0.0;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const double x = noise[i] / deviation;
    mean += x / rows;
    variance += x * x / rows;
    fourth += x * x * x * x / rows;
    if (i > 0) neighbours += x * noise[i - 1] / deviation / rows;
  }
  // Five standard deviations of each estimate: 1, sqrt(2), sqrt(96), 1 over sqrt(rows).
  const double five = 5.0 / std::sqrt(rows);
  EXPECT_NEAR(mean, 0.0, five);
  EXPECT_NEAR(variance, 1.0, std::sqrt(2.0) * five);
  EXPECT_NEAR(fourth, 3.0, std::sqrt(96.0) * five);
  EXPECT_NEAR(neighbours, 0.0, five);
}

TEST(SensorReadings, NoiseIsTheSameForTheSameSeedAndDependsOnNothingElse) {
  const SensorErrors noisy{{}, {1.0}, {}, 0, 0};
  const auto first = read(noisy, 11, 50, 1e-3, zero);
  EXPECT_EQ(first, read(noisy, 11, 50, 1e-3, zero));
  EXPECT_NE(first, read(noisy, 12, 50, 1e-3, zero));
  // Another sensor before it, and other values, change nothing: a name has its own numbers.
  const Model two = model_with({noisy, noisy});
  SensorSampler readings(two, 11);
  VectorX row(2);
  for (const double expected : first) {
    readings.read(0.0, Eigen::Vector2d(0.0, 5.0), row);
    EXPECT_EQ(row[0], expected);
    EXPECT_NE(row[1] - 5.0, expected);
  }
  // The numbers are a function of seed and counter, written down here for all machines.
  EXPECT_EQ(normal_number(1, 0), normal_number(1, 0));
  EXPECT_NE(normal_number(1, 0), normal_number(1, 1));
}

TEST(SensorReadings, BiasIsAddedAndValuesAreRoundedToTheQuantum) {
  const auto rows = read({{0.5}, {}, {0.25}, 0, 0}, 1, 100, 0.01, time_itself);
  for (int i = 0; i < 100; ++i) {
    const double exact = 0.01 * i + 0.5, reading = rows[static_cast<std::size_t>(i)];
    EXPECT_LE(std::abs(reading - exact), 0.125 + 1e-15);
    EXPECT_EQ(reading, 0.25 * std::round(reading / 0.25));
  }
}

TEST(SensorReadings, SamplesAreHeldBetweenTheirTimes) {
  // 100 samples per second in rows of 2 ms: five rows each.
  const auto rows = read({{}, {}, {}, 100.0, 0}, 1, 500, 0.002, time_itself);
  for (int i = 0; i < 500; ++i)
    EXPECT_EQ(rows[static_cast<std::size_t>(i)], 0.002 * (i / 5 * 5)) << i;
  // 60 samples per second: the first row at or after k / 60.
  const auto odd = read({{}, {}, {}, 60.0, 0}, 1, 500, 0.002, time_itself);
  for (int i = 0; i < 500; ++i) {
    const double sample = std::floor(0.002 * i * 60.0 + 1e-6) / 60.0;
    EXPECT_EQ(odd[static_cast<std::size_t>(i)], 0.002 * std::ceil(sample / 0.002 - 1e-6)) << i;
  }
}

TEST(SensorReadings, AppearAfterTheirDelay) {
  const auto rows = read({{}, {}, {}, 0, 0.01}, 1, 100, 0.002, time_itself);
  for (int i = 0; i < 100; ++i) {
    const double reading = rows[static_cast<std::size_t>(i)];
    if (i < 5)
      EXPECT_TRUE(std::isnan(reading)) << i;
    else
      EXPECT_EQ(reading, 0.002 * (i - 5)) << i;
  }
}

TEST(SensorReadings, MistakesInErrorsAreNamed) {
  const auto refused = [](const SensorErrors& errors, const std::string& part) {
    try {
      model_with({errors});
      ADD_FAILURE() << "accepted; expected a refusal of " << part;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("sensor 'q0'"), std::string::npos) << error.what();
    }
  };
  refused({{}, {-1.0}, {}, 0, 0}, "noise");
  refused({{1.0, 2.0}, {}, {}, 0, 0}, "bias has 2 numbers");
  refused({{}, {}, {}, -5.0, 0}, "rate");
  refused({{}, {}, {}, 0, std::nan("")}, "delay");
}

}  // namespace
}  // namespace counterpoint::sensor_readings_test
