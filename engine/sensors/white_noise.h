// Normally distributed numbers that are functions of a counter: no state, and no function of the
// standard library whose last bits differ between machines.
#pragma once

#include <cstdint>

namespace counterpoint {

/// Uniform numbers that belong to a pair (seed, counter), from the finalizer of SplitMix64 (Steele,
/// Lea, Flood 2014).
class CounterStream {
 public:
  CounterStream(std::uint64_t seed, std::uint64_t counter)
      : state_(mixed(seed ^ mixed(counter + kStep))) {}
  /// Returns the next number of 0 < x < 1.
  double uniform() {
    state_ += kStep;
    return (static_cast<double>(mixed(state_) >> 11) + 0.5) * 0x1.0p-53;
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15u;
  static std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }

  std::uint64_t state_;
};

/// Returns an exponentially distributed number of mean 1 by comparisons alone (von Neumann 1951): a
/// descending run of uniform numbers that begins with x has odd length with probability exp(-x).
inline double exponential_number(CounterStream& stream) {
  for (double whole = 0.0;; whole += 1.0) {
    const double first = stream.uniform();
    bool odd = true;
    double last = first;
    for (double next = stream.uniform(); next < last; next = stream.uniform()) {
      last = next;
      odd = !odd;
    }
    if (odd) return whole + first;
  }
}

/// Returns a number with mean 0 and standard deviation 1 that belongs to (seed, counter): of an
/// exponentially distributed x, exp(-(x - 1)^2 / 2) are kept, with either sign (Kahn 1956).
inline double normal_number(std::uint64_t seed, std::uint64_t counter) {
  CounterStream stream(seed, counter);
  for (;;) {
    const double x = exponential_number(stream);
    if (2.0 * exponential_number(stream) < (x - 1.0) * (x - 1.0)) continue;
    return stream.uniform() < 0.5 ? -x : x;
  }
}

}  // namespace counterpoint
