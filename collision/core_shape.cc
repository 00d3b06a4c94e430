#include "counterpoint/collision/core_shape.h"

#include <cmath>

namespace counterpoint::collision {

int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start) {
  constexpr int kScanAtMost = 24;
  const int size = static_cast<int>(mesh.vertices.size());
  int best = start;
  double height = mesh.vertices[best].dot(direction);
  if (size <= kScanAtMost) {
    for (int i = 0; i < size; ++i) {
      const double h = mesh.vertices[i].dot(direction);
      if (h > height) {
        height = h;
        best = i;
      }
    }
    return best;
  }
  for (bool climbed = true; climbed;) {
    climbed = false;
    const int from = best;
    for (const int i : mesh.vertex_neighbors[from]) {
      const double h = mesh.vertices[i].dot(direction);
      if (h > height) {
        height = h;
        best = i;
        climbed = true;
      }
    }
  }
  return best;
}

Vector3 CoreShape::support(const Vector3& direction) const {
  const Vector3 local = X.rotation.transpose() * direction;
  const Vector3& size = shape.size;
  switch (shape.type) {
    case ShapeType::kSphere: return X.translation;
    case ShapeType::kCapsule:
      return X.translation + X.rotation.col(2) * (local.z() < 0.0 ? -size[1] : size[1]);
    case ShapeType::kBox:
      return X * Vector3(local.x() < 0.0 ? -size[0] : size[0], local.y() < 0.0 ? -size[1] : size[1],
                         local.z() < 0.0 ? -size[2] : size[2]);
    case ShapeType::kCylinder: {
      const double radial = std::sqrt(local.x() * local.x() + local.y() * local.y());
      const double scale = radial > 0.0 ? size[0] / radial : 0.0;
      return X * Vector3(local.x() * scale, local.y() * scale, local.z() < 0.0 ? -size[1] : size[1]);
    }
    case ShapeType::kConvexMesh:
      hint = support_vertex(*shape.mesh, local, hint);
      return X * shape.mesh->vertices[hint];
    case ShapeType::kPlane: break;
  }
  return X.translation;
}

Vector3 CoreShape::center() const {
  return shape.type == ShapeType::kConvexMesh ? X * shape.mesh->interior_point : X.translation;
}

double CoreShape::extent() const {
  switch (shape.type) {
    case ShapeType::kCapsule: return shape.size[1];
    case ShapeType::kBox: return shape.size.norm();
    case ShapeType::kCylinder: return shape.size[0] + shape.size[1];
    case ShapeType::kConvexMesh: return shape.mesh->radius;
    case ShapeType::kSphere:
    case ShapeType::kPlane: break;
  }
  return 0.0;
}

}  // namespace counterpoint::collision
