// Names of shape types, which C++ has no use for.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint::python {

inline const char* shape_type_name(ShapeType type) {
  switch (type) {
    case ShapeType::kPlane:
      return "plane";
    case ShapeType::kSphere:
      return "sphere";
    case ShapeType::kBox:
      return "box";
    case ShapeType::kCapsule:
      return "capsule";
    case ShapeType::kCylinder:
      return "cylinder";
    case ShapeType::kConvexMesh:
      return "convex_mesh";
    case ShapeType::kTerrain:
      return "terrain";
  }
  return "";
}

}  // namespace counterpoint::python
