// Geometries of a model by name.
#pragma once

#include <string>

#include "counterpoint/model/model.h"

namespace counterpoint::test {

/// Index of a geometry by name; -1 if there is none.
inline int find_geometry(const Model& model, const std::string& name) {
  for (size_t i = 0; i < model.geometries().size(); ++i)
    if (model.geometries()[i].name == name) return static_cast<int>(i);
  return -1;
}

}  // namespace counterpoint::test
