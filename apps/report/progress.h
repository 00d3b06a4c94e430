// A progress bar on the terminal with the remaining time, for work that takes longer than a second.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace counterpoint::apps {

/// Draws on standard error if that is a terminal, and erases the bar at the end.
class Progress {
 public:
  /// @param delay time from construction to the first bar [s]
  /// @param unit name of the counted items, such as "tasks". If given, the bar also shows their
  ///     rate; if standard error is no terminal (the log of a cluster job), a line is written every
  ///     minute.
  Progress(std::string label, std::int64_t total, double delay = 1.0, std::string unit = "");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double done);
  /// For work of unknown length: shows the elapsed time.
  void show_time();
  /// Erases the bar until the next update, so that something else can be printed.
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
