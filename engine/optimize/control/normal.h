// Normally distributed numbers that are the same with every standard library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace counterpoint::optimization {

class NormalNumbers {
 public:
  explicit NormalNumbers(std::uint64_t seed) : generator_(seed) {}
  /// Returns a number with mean 0 and standard deviation 1, by the Box-Muller transform
  /// (std::normal_distribution differs between standard libraries).
  double operator()() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  double uniform() { return (static_cast<double>(generator_() >> 11) + 0.5) * 0x1.0p-53; }

  std::mt19937_64 generator_;
};

}  // namespace counterpoint::optimization
