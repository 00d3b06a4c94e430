// Writes measured values of a test into its report.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace counterpoint::test {

/// Records the largest magnitude of its arguments as a property of the running test, for
/// scripts/figures.py. `name` ends in the unit.
class RecordLargest {
 public:
  explicit RecordLargest(const char* name) : name_(name) {}
  ~RecordLargest() { ::testing::Test::RecordProperty(name_, fmt::format("{:.2g}", largest_)); }
  RecordLargest(const RecordLargest&) = delete;
  RecordLargest& operator=(const RecordLargest&) = delete;

  /// Returns its argument.
  double operator()(double value) {
    // A NaN counts as the largest and is kept.
    if (!std::isnan(largest_) && !(std::abs(value) <= largest_)) largest_ = std::abs(value);
    return value;
  }

 private:
  const char* name_;
  double largest_ = 0.0;
};

}  // namespace counterpoint::test
