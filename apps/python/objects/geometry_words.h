// Names of geometry enumerations in Python.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint::python {

inline const char* shape_type_name(ShapeType type) {
  return counterpoint::shape_type_name(type, "convex_mesh");
}

}  // namespace counterpoint::python
