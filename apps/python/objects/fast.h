// Fast replacements for the most frequent calls in Python loops, since the dispatch of pybind11
// takes half a microsecond. A method or property is first defined by pybind11, then replaced by a
// native one of CPython with the same name and docstring.
#pragma once

#include "exceptions.h"

namespace counterpoint::python {

/// Returns the C++ object held by an instance of a pybind11 class. @throws py::type_error if there
/// is none.
template <class T>
T& held_by(PyObject* self) {
  auto* instance = reinterpret_cast<py::detail::instance*>(self);
  if (!instance->simple_layout) return py::handle(self).cast<T&>();
  void* const object = instance->simple_value_holder[0];
  if (object == nullptr) throw py::type_error("__init__() was not called");
  return *static_cast<T*>(object);
}

/// Runs call(), which returns a new reference; translates exceptions to Python's.
template <class Call>
PyObject* translated(Call call) {
  try {
    return call();
  } catch (...) {
    set_python_error();
  }
  return nullptr;
}

/// Replaces the getter of a property. Get, without captures, maps T& to a new reference.
template <class T, class Get>
void make_fast(const py::handle& type, const char* name, Get) {
  if (has_signatures()) return;  // a native property has none
  const py::object slow = type.attr("__dict__")[name];
  const py::object set = slow.attr("fset");
  // Owned by the interpreter, like the type: never freed.
  auto* text = new std::string(py::str(slow.attr("__doc__")).cast<std::string>());
  auto* definition = new PyGetSetDef{};
  definition->name = name;
  definition->doc = text->c_str();
  definition->get = [](PyObject* self, void*) -> PyObject* {
    return translated([&] { return Get{}(held_by<T>(self)); });
  };
  if (!set.is_none()) {
    definition->closure = set.inc_ref().ptr();
    definition->set = [](PyObject* self, PyObject* value, void* own) -> int {
      if (value == nullptr) {
        PyErr_SetString(PyExc_AttributeError, "cannot be deleted");
        return -1;
      }
      PyObject* done =
          PyObject_CallFunctionObjArgs(static_cast<PyObject*>(own), self, value, nullptr);
      Py_XDECREF(done);
      return done == nullptr ? -1 : 0;
    };
  }
  type.attr(name) = py::reinterpret_steal<py::object>(
      PyDescr_NewGetSet(reinterpret_cast<PyTypeObject*>(type.ptr()), definition));
}

inline PyObject* new_reference(const py::object& object) { return object.inc_ref().ptr(); }

}  // namespace counterpoint::python
