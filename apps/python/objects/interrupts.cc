#include "interrupts.h"

#include <future>

namespace counterpoint::python {
namespace {

constexpr std::chrono::milliseconds kInterval(100);  ///< between two checks for signals

bool in_main_thread() {
  const py::module_ threading = py::module_::import("threading");
  return threading.attr("get_ident")().equal(threading.attr("main_thread")().attr("ident"));
}

}  // namespace

SignalWatch::SignalWatch() : read_(Clock::now()), checked_(read_) {}

bool SignalWatch::interrupted() {
  if (type_) return true;
  if (!main_ || --left_ > 0) return false;
  // Adapts the number of calls per clock reading to the interval, since a step can take less time
  // than a reading.
  const Clock::time_point now = Clock::now();
  const auto since = now - read_;
  if (since < kInterval / 8)
    stride_ *= 2;
  else if (since > kInterval / 4 && stride_ > 1)
    stride_ /= 2;
  left_ = stride_;
  read_ = now;
  if (now - checked_ < kInterval) return false;
  checked_ = now;
  const py::gil_scoped_acquire acquire;
  return check();
}

bool SignalWatch::check() {
  if (type_) return true;
  if (PyErr_CheckSignals() != 0) fetch();
  main_ = in_main_thread();
  return static_cast<bool>(type_);
}

void SignalWatch::keep(py::error_already_set& error) {
  error.restore();
  if (type_)
    PyErr_Clear();  // the first exception is the one reported
  else
    fetch();
}

void SignalWatch::fetch() {
  PyObject *type = nullptr, *value = nullptr, *traceback = nullptr;
  PyErr_Fetch(&type, &value, &traceback);
  PyErr_NormalizeException(&type, &value, &traceback);
  type_ = py::reinterpret_steal<py::object>(type);
  value_ = py::reinterpret_steal<py::object>(value);
  traceback_ = py::reinterpret_steal<py::object>(traceback);
}

void SignalWatch::raise_if_interrupted(const py::object& partial) {
  if (!check()) return;
  set_partial(value_, partial);
  PyErr_Restore(type_.release().ptr(), value_.release().ptr(), traceback_.release().ptr());
  throw py::error_already_set();
}

void run_interruptibly(SignalWatch& watch, std::atomic<bool>& stop,
                       const std::function<void()>& compute) {
  const bool looks = in_main_thread();
  const py::gil_scoped_release release;
  std::future<void> done = std::async(std::launch::async, compute);
  while (looks && done.wait_for(kInterval) != std::future_status::ready) {
    const py::gil_scoped_acquire acquire;
    if (!stop && watch.check()) stop = true;
  }
  done.get();
}

void set_partial(py::handle exception, const py::object& partial) {
  // An exception type that accepts no attributes is raised without it.
  if (PyObject_SetAttrString(exception.ptr(), "partial", partial.ptr()) != 0) PyErr_Clear();
}

}  // namespace counterpoint::python
