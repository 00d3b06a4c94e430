// Names of shape types.
#pragma once

#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// "plane", "sphere" ...; `convex_mesh`: what a convex mesh is called where the name goes.
inline const char* shape_type_name(ShapeType type, const char* convex_mesh) {
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
      return convex_mesh;
    case ShapeType::kTerrain:
      return "terrain";
  }
  return "?";
}

}  // namespace counterpoint
