// Ctrl-C ends long computations and keeps the results so far.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>

#include "bindings.h"

namespace counterpoint::python {

/// Checks for signals (PyErr_CheckSignals) within computations that have released the GIL, about
/// ten times a second and only in Python's main thread, which handles them. Construct and destroy
/// it while holding the GIL.
class SignalWatch {
 public:
  SignalWatch();

  /// True if a signal handler has raised an exception, so that the computation should end. Call it
  /// often, without the GIL, from the thread that constructed the object; most calls only count.
  bool interrupted();
  /// Checks at once, while holding the GIL. Also takes over an exception that is set as raised.
  bool check();
  /// Stores the exception that is being handled, raised by a user's function; needs the GIL.
  void keep(py::error_already_set& error);

  /// At the end, with the GIL: raises the stored exception, with `partial` as its attribute of that
  /// name.
  void raise_if_interrupted(const py::object& partial);
  bool raised() const { return static_cast<bool>(type_); }

 private:
  using Clock = std::chrono::steady_clock;
  void fetch();

  py::object type_, value_, traceback_;
  Clock::time_point read_, checked_;
  long left_ = 1, stride_ = 1;
  bool main_ = true;  ///< true unless known to be another thread
};

/// Runs `compute` on a separate thread without the GIL while this thread checks for signals; for
/// computations on several threads. Sets `stop` to true when a handler has raised an exception;
/// compute() should then end early. Rethrows exceptions of compute().
void run_interruptibly(SignalWatch& watch, std::atomic<bool>& stop,
                       const std::function<void()>& compute);

/// Stores the results so far as the attribute `partial` of an exception about to be raised.
void set_partial(py::handle exception, const py::object& partial);

}  // namespace counterpoint::python
