// A progress bar on the terminal, with the time that is left, for work that takes longer than a
// second.
#pragma once

#include <chrono>
#include <string>

namespace counterpoint::apps {

/// Draws on standard error, only if that is a terminal; wipes itself at the end.
class Progress {
 public:
  /// @param delay  of the first bar, after construction [s]
  Progress(std::string label, int total, double delay = 1.0);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(int done);
  /// For work of unknown length: the time that it has taken.
  void show_time();
  /// Takes the bar away until the next update: something else is about to be printed.
  void wipe();

 private:
  using Clock = std::chrono::steady_clock;
  bool due();
  double elapsed() const;  ///< [s]

  std::string label_;
  int total_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_, next_draw_;
};

}  // namespace counterpoint::apps
