#include <algorithm>
#include <cmath>

#include "counterpoint/collision/collider.h"

namespace counterpoint::collision {

double bounding_radius(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      return 0.0;  // fixed to the world
    case ShapeType::kSphere:
      return shape.size.x();
    case ShapeType::kBox:
      return shape.size.norm();
    case ShapeType::kCapsule:
      return shape.size.x() + shape.size.y();
    case ShapeType::kCylinder:
      return std::hypot(shape.size.x(), shape.size.y());
    case ShapeType::kConvexMesh: {
      double radius = 0.0;
      for (const Vector3& v : shape.mesh->vertices) radius = std::max(radius, v.norm());
      return radius;
    }
  }
  return 0.0;
}

std::vector<double> body_radii(const Model& model) {
  std::vector<double> radius(model.num_bodies(), 0.0);
  for (const Geometry& g : model.geometries())
    radius[g.body] = std::max(radius[g.body], g.X_BG.translation.norm() + bounding_radius(g.shape));
  return radius;
}

}  // namespace counterpoint::collision
