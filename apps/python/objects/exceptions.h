// Exceptions that exist in Python only.
#pragma once

#include <filesystem>
#include <string>

#include "bindings.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::python {

/// StepError with `report` and `partial`.
[[noreturn]] void throw_step_error(const std::string& message, const py::object& report,
                                   const py::object& partial);
[[noreturn]] void throw_file_not_found(const std::filesystem::path& file,
                                       const std::string& message);

/// The exception that is being handled as Python's: for what pybind11 does not call.
void set_python_error();

/// Calls read() without the GIL; an InputError about a file that is not there becomes a
/// FileNotFoundError of the same message.
template <class Read>
auto reading(const std::filesystem::path& file, Read read) {
  try {
    const py::gil_scoped_release release;
    return read();
  } catch (const InputError& e) {
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) throw_file_not_found(file, e.what());
    throw;
  }
}

}  // namespace counterpoint::python
