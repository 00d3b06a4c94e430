// A progress bar on the terminal, with the time that is left, for work that takes longer than a
// second.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace counterpoint::apps {

/// Draws on standard error, in general only if that is a terminal; wipes itself at the end.
class Progress {
 public:
  /// @param delay  of the first bar, after construction [s]
  /// @param unit   what is counted, "tasks": the bar then has their rate, and where standard error
  ///               is no terminal (a log of a cluster's job) a line is written every minute
  Progress(std::string label, std::int64_t total, double delay = 1.0, std::string unit = "");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double done);
  /// For work of unknown length: the time that it has taken.
  void show_time();
  /// Takes the bar away until the next update: something else is about to be printed.
  void wipe();

 private:
  using Clock = std::chrono::steady_clock;
  bool due();
  double elapsed() const;  ///< [s]

  void log(double done);
  std::string rate_and_rest(double done) const;

  std::string label_, unit_;
  std::int64_t total_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_, next_draw_;
};

}  // namespace counterpoint::apps
