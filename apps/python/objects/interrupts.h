// Ctrl-C ends what takes long, with what was computed so far.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>

#include "bindings.h"

namespace counterpoint::python {

/// Looks for signals (PyErr_CheckSignals) within computations that have released the GIL, about ten
/// times a second and in Python's main thread alone, which handles them. Made and destroyed with
/// the GIL.
class SignalWatch {
 public:
  SignalWatch();

  /// A signal's handler has raised: end what is going on. Called often, without the GIL, by the
  /// thread that made this; most calls only count.
  bool interrupted();
  /// The same, with the GIL, at once. Takes an exception that is set as raised, too.
  bool check();
  /// Keeps the exception that is being handled, raised by a caller's own function; with the GIL.
  void keep(py::error_already_set& error);

  /// With the GIL, at the end: what was raised, `partial` being its attribute of that name.
  void raise_if_interrupted(const py::object& partial);
  bool raised() const { return static_cast<bool>(type_); }

 private:
  using Clock = std::chrono::steady_clock;
  void fetch();

  py::object type_, value_, traceback_;
  Clock::time_point read_, checked_;
  long left_ = 1, stride_ = 1;
  bool main_ = true;  ///< as far as is known
};

/// Runs `compute` on a thread of its own, without the GIL, while this one looks for signals: for
/// what is computed by several threads. `stop` becomes true when a handler has raised; compute()
/// then ends early. Exceptions of compute() come out of this.
void run_interruptibly(SignalWatch& watch, std::atomic<bool>& stop,
                       const std::function<void()>& compute);

/// Gives an exception that is to be raised what was computed so far, as its attribute `partial`.
void set_partial(py::handle exception, const py::object& partial);

}  // namespace counterpoint::python
