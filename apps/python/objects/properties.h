// Getters of properties that show members of the C++ object.
#pragma once

#include <functional>
#include <memory>

#include "arrays.h"

namespace counterpoint::python {

/// A copy of a value for Python; that of a vector is an array.
template <class Value>
Value for_python(const Value& value) {
  return value;
}
inline py::array for_python(const Vector3& x) { return copy(VectorX(x)); }
inline py::array for_python(const VectorX& x) { return copy(x); }

/// Getter of a member that is a vector: copies it to an array.
template <class Object, class Value>
auto copy_of(Value Object::*member) {
  return [member](const Object& object) { return for_python(object.*member); };
}

/// Getter of a member of a part of the object; a member function of the part is called:
/// `through(&ReportHandle::report, &StepReport::contacts)`.
template <class Object, class Part, class Member>
auto through(Part Object::*part, Member member) {
  return [part, member](const Object& object) {
    return for_python(std::invoke(member, object.*part));
  };
}
/// The same of a part that a function finds.
template <class Object, class Part, class Member>
auto through(const Part& (*part)(const Object&), Member member) {
  return [part, member](const Object& object) {
    return for_python(std::invoke(member, part(object)));
  };
}

/// Getter of an array that shows a vector or matrix of an object that is no longer changed by C++.
template <class Object, class Value>
auto view_of(Value Object::*member) {
  return [member](const std::shared_ptr<Object>& object) {
    return view((*object).*member, py::cast(object), true);
  };
}

}  // namespace counterpoint::python
