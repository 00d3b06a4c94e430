// Translates C++ exceptions to Python's.
#include "exceptions.h"

#include <filesystem>

#include "counterpoint/model/spatial.h"

namespace counterpoint::python {
namespace {

/// Owned by the interpreter: set when the module is imported and never released.
PyObject* input_error = nullptr;
PyObject* step_error = nullptr;

py::object new_exception(py::module_& m, const char* name, PyObject* base, const char* doc) {
  const std::string full = std::string("counterpoint.") + name;
  py::object type = py::reinterpret_steal<py::object>(
      PyErr_NewExceptionWithDoc(full.c_str(), doc, base, nullptr));
  if (!type) throw py::error_already_set();
  m.attr(name) = type;
  return type;
}

}  // namespace

void throw_step_error(const std::string& message, const py::object& report,
                      const py::object& partial) {
  const py::object error = py::handle(step_error)(message);
  error.attr("report") = report;
  error.attr("partial") = partial;
  PyErr_SetObject(step_error, error.ptr());
  throw py::error_already_set();
}

void throw_file_not_found(const std::filesystem::path& file, const std::string& message) {
  const py::object error = py::handle(PyExc_FileNotFoundError)(ENOENT, message, file.string());
  PyErr_SetObject(PyExc_FileNotFoundError, error.ptr());
  throw py::error_already_set();
}

void set_python_error() {
  try {
    throw;
  } catch (py::error_already_set& e) {
    e.restore();
  } catch (const py::builtin_exception& e) {
    e.set_error();
  } catch (const InputError& e) {
    PyErr_SetString(input_error, e.what());
  } catch (const std::exception& e) {
    PyErr_SetString(PyExc_RuntimeError, e.what());
  }
}

void bind_exceptions(py::module_& m) {
  input_error =
      new_exception(m, "InputError", PyExc_ValueError,
                    "Input a user can correct: the message says where, what was expected, "
                    "and what to do.")
          .release()
          .ptr();
  step_error = new_exception(m, "StepError", PyExc_RuntimeError, R"(
A step that could not be done: the message names the body, joint, contact or number at fault.

Attributes
----------
report : StepReport
    What the step said.
partial : Trajectory or None
    Of Simulator.run: the motion before it.
)")
                   .release()
                   .ptr();
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const InputError& e) {
      PyErr_SetString(input_error, e.what());
    }
  });
}

}  // namespace counterpoint::python
