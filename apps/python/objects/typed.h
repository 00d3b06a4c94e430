// Python objects that signatures, and so the stubs, give an exact type.
#pragma once

#include <algorithm>

#include "bindings.h"

namespace counterpoint::python {

/// The text of a type, as a template argument.
template <size_t N>
struct TypeText {
  // Implicit, since it is written as a literal.
  constexpr TypeText(const char (&given)[N]) { std::copy_n(given, N, text); }
  char text[N];
};

/// A py::object, py::dict ... that signatures call `kType`.
template <class Object, TypeText kType>
class Typed : public Object {
 public:
  using Object::Object;
  Typed() = default;
  // Implicit, since it is the same object.
  Typed(const Object& same) : Object(same) {}
  static bool check_(py::handle given) { return py::isinstance<Object>(given); }
};

/// A name or number, for index_from.
using Key = Typed<py::object, "Union[str, int]">;
/// A pose or array, for pose_from.
using PoseLike = Typed<py::object, "Union[Pose, ArrayLike, None]">;
using NumbersByName = Typed<py::dict, "Dict[str, float]">;

}  // namespace counterpoint::python

template <class Object, counterpoint::python::TypeText kType>
struct pybind11::detail::handle_type_name<counterpoint::python::Typed<Object, kType>> {
  static constexpr auto name = const_name(kType.text);
};
