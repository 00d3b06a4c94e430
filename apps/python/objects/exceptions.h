// Exceptions that exist in Python only.
#pragma once

#include <filesystem>
#include <string>

#include "bindings.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::python {

/// Throws StepError with the attributes `report` and `partial`.
[[noreturn]] void throw_step_error(const std::string& message, const py::object& report,
                                   const py::object& partial);
[[noreturn]] void throw_file_not_found(const std::filesystem::path& file,
                                       const std::string& message);

/// Sets the exception that is being handled as Python's error, for functions that are not called
/// through pybind11.
void set_python_error();

/// Calls read() without the GIL. Turns an InputError about a missing file into a FileNotFoundError
/// with the same message.
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
