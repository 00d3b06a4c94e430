#include "counterpoint/model/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint {
double lowest_point(const Shape& shape, const Pose& X_WG) {
  const double z = X_WG.translation.z();
  const Vector3 up = X_WG.rotation.row(2);  // world z axis in the axes of G
  const Vector3& size = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane:
      return -std::numeric_limits<double>::infinity();
    case ShapeType::kSphere:
      return z - size[0];
    case ShapeType::kBox:
      return z - up.cwiseAbs().dot(size);
    case ShapeType::kCapsule:
      return z - std::abs(up[2]) * size[1] - size[0];
    case ShapeType::kCylinder:
      return z - std::abs(up[2]) * size[1] - std::hypot(up[0], up[1]) * size[0];
    case ShapeType::kConvexMesh: {
      double low = std::numeric_limits<double>::infinity();
      for (const Vector3& v : shape.mesh->vertices) low = std::min(low, up.dot(v));
      return z + low;
    }
    case ShapeType::kTerrain: {
      double low = std::numeric_limits<double>::infinity();
      for (const Vector3& v : shape.terrain->vertices) low = std::min(low, up.dot(v));
      return z + low;
    }
  }
  return z;
}

}  // namespace counterpoint
