// Shapes in MJCF.
#pragma once

#include <string>
#include <utility>

#include "counterpoint/model/export/numbers.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint {

/// Returns the attributes type and size; empty if MJCF has no such shape. @throws InputError for a
/// plane that is not fixed to the world.
inline std::pair<std::string, std::string> mjcf_shape(const Geometry& g) {
  const Vector3& s = g.shape.size;
  switch (g.shape.type) {
    case ShapeType::kPlane:
      if (g.body != 0)
        throw InputError("geometry '" + g.name +
                         "': MJCF has planes on the world only; use a box in its place");
      return {"plane", "0 0 1"};
    case ShapeType::kSphere:
      return {"sphere", export_number(s.x())};
    case ShapeType::kBox:
      return {"box", export_numbers(s)};
    case ShapeType::kCapsule:
      return {"capsule", export_numbers({s.x(), s.y()})};
    case ShapeType::kCylinder:
      return {"cylinder", export_numbers({s.x(), s.y()})};
    case ShapeType::kConvexMesh:
      return {"mesh", ""};
    case ShapeType::kTerrain:
      break;
  }
  return {};
}

}  // namespace counterpoint
