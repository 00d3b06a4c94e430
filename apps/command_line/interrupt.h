// Ctrl-C ends a run but not the program, so that results so far are kept.
#pragma once

namespace counterpoint::apps {

/// While an object is alive, the first SIGINT or SIGTERM is only noted. A second one ends the
/// program as usual, and so does a computation that goes on for 0.9 s after the first. Signals are
/// noted per process: only one object at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  /// Call when the computation is over: a noted signal stays noted, results may take any time to
  /// save, and the next signal ends the program.
  static void end();
  /// Does as a first signal does, but sets no time by which the computation must have ended.
  static void want();
  /// True if a signal has been received, or want() was called.
  static bool wanted();
};

}  // namespace counterpoint::apps
