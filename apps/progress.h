// A progress bar on the terminal, with the time that is left, for work that takes longer than a second.
#pragma once

#include <chrono>
#include <string>

namespace counterpoint::apps {

/// Draws on standard error, only if that is a terminal; wipes itself at the end.
class Progress {
 public:
  Progress(std::string label, int total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(int done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  int total_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_, next_draw_;
};

}  // namespace counterpoint::apps
