// The most frequent calls of loops in Python, without pybind11's dispatch, which takes half a
// microsecond. A
// method or property defined by pybind11 first is replaced by one of CPython's own kind, with the
// same name and docstring.
#pragma once

#include "exceptions.h"

namespace counterpoint::python {

/// The C++ object of an instance of a class of pybind11. @throws py::type_error where it has none.
template <class T>
T& held_by(PyObject* self) {
  auto* instance = reinterpret_cast<py::detail::instance*>(self);
  if (!instance->simple_layout) return py::handle(self).cast<T&>();
  void* const object = instance->simple_value_holder[0];
  if (object == nullptr) throw py::type_error("__init__() was not called");
  return *static_cast<T*>(object);
}

/// Runs call(), which returns a new reference; exceptions become Python's.
template <class Call>
PyObject* translated(Call call) {
  try {
    return call();
  } catch (...) {
    set_python_error();
  }
  return nullptr;
}

/// Replaces the getter of a property; Get, which has no captures, gives a new reference from T&.
template <class T, class Get>
void make_fast(const py::handle& type, const char* name, Get) {
  const py::object slow = type.attr("__dict__")[name];
  const py::object set = slow.attr("fset");
  // Of the interpreter, as the type is: never freed.
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
