// Quantiles of the cost of steps: a mean hides the longest step, for which a controller has to
// wait.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "report/report.h"

namespace counterpoint::apps {

/// Histogram of whole numbers from 0.
class Counts {
 public:
  void add(long value) {
    const auto index = static_cast<std::size_t>(std::max(value, 0L));
    if (index >= counts_.size()) counts_.resize(index + 1, 0);
    ++counts_[index];
    ++total_;
  }
  /// Smallest number that is at least as large as a share `p` of all numbers; 0 if there are none.
  long quantile(double p) const {
    const long wanted = std::max(1L, std::lround(std::ceil(p * static_cast<double>(total_))));
    long seen = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      seen += counts_[i];
      if (seen >= wanted) return static_cast<long>(i);
    }
    return 0;
  }

 private:
  std::vector<long> counts_;
  long total_ = 0;
};

/// Newton steps and processor time of every step. Memory does not grow with the length of a run:
/// times are counted in classes that are 2 % wide.
class StepStatistics {
 public:
  void add(long newton_iterations, double seconds) {
    newton_.add(newton_iterations);
    const double us = 1e6 * seconds;
    longest_us_ = std::max(longest_us_, us);
    times_.add(std::lround(std::log(std::max(us / kShortest, 1.0)) / std::log(kWidth)));
  }
  void fill(Json& out) const {
    out["newton_iterations_p99"] = newton_.quantile(0.99);
    out["step_time_median_us"] = time(0.5);
    out["step_time_p99_us"] = time(0.99);
    out["step_time_max_us"] = longest_us_;
  }

 private:
  static constexpr double kShortest = 0.01, kWidth = 1.02;  // [us], [-]

  double time(double p) const {
    return std::min(longest_us_, kShortest * std::pow(kWidth, times_.quantile(p)));
  }

  Counts newton_, times_;
  double longest_us_ = 0.0;
};

}  // namespace counterpoint::apps
