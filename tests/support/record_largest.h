// What a test measured, in its report.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace counterpoint::test {

/// Records the largest magnitude it was shown as a property of the running test (scripts/figures.py
/// prints these). `name` ends in the unit.
class RecordLargest {
 public:
  explicit RecordLargest(const char* name) : name_(name) {}
  ~RecordLargest() { ::testing::Test::RecordProperty(name_, fmt::format("{:.2g}", largest_)); }
  RecordLargest(const RecordLargest&) = delete;
  RecordLargest& operator=(const RecordLargest&) = delete;

  /// Returns what it was shown.
  double operator()(double value) {
    // A NaN is the largest, and stays.
    if (!std::isnan(largest_) && !(std::abs(value) <= largest_)) largest_ = std::abs(value);
    return value;
  }

 private:
  const char* name_;
  double largest_ = 0.0;
};

}  // namespace counterpoint::test
