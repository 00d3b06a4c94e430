// Ctrl-C ends a run, not the program: what was computed is kept.
#pragma once

namespace counterpoint::apps {

/// While one is alive the first SIGINT or SIGTERM is only noted; the second one ends the program as
/// usual, and so does a computation that goes on for 0.9 s after the first. A signal has no other
/// place to be noted than the process: one at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  /// The computation is over: what was noted stays, saving takes its time, a signal ends the
  /// program.
  static void end();
  /// A signal has come.
  static bool wanted();
};

}  // namespace counterpoint::apps
