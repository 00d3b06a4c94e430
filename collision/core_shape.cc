#include "counterpoint/collision/core_shape.h"

#include <cmath>

namespace counterpoint::collision {

namespace {

// With no more vertices than this looking at all is as fast as climbing.
constexpr int kScanAtMost = 24;

}  // namespace

int scan_vertices(const ConvexMesh& mesh, const Vector3& direction, int start) {
  int best = start;
  double height = mesh.vertices[best].dot(direction);
  for (int i = 0; i < static_cast<int>(mesh.vertices.size()); ++i) {
    const double h = mesh.vertices[i].dot(direction);
    if (h > height) {
      height = h;
      best = i;
    }
  }
  return best;
}

int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start) {
  if (static_cast<int>(mesh.vertices.size()) <= kScanAtMost) {
    return scan_vertices(mesh, direction, start);
  }
  int best = start;
  double height = mesh.vertices[best].dot(direction);
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
    case ShapeType::kSphere:
      return X.translation;
    case ShapeType::kCapsule:
      return X.translation + X.rotation.col(2) * (local.z() < 0.0 ? -size[1] : size[1]);
    case ShapeType::kBox:
      return X * Vector3(local.x() < 0.0 ? -size[0] : size[0], local.y() < 0.0 ? -size[1] : size[1],
                         local.z() < 0.0 ? -size[2] : size[2]);
    case ShapeType::kCylinder: {
      const double radial = std::sqrt(local.x() * local.x() + local.y() * local.y());
      const double scale = radial > 0.0 ? size[0] / radial : 0.0;
      return X *
             Vector3(local.x() * scale, local.y() * scale, local.z() < 0.0 ? -size[1] : size[1]);
    }
    case ShapeType::kConvexMesh:
      hint =
          scan ? scan_vertices(*shape.mesh, local, hint) : support_vertex(*shape.mesh, local, hint);
      return X * shape.mesh->vertices[hint];
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return X.translation;
}

double CoreShape::scan_support(const Vector3& direction) const {
  if (shape.type != ShapeType::kConvexMesh ||
      static_cast<int>(shape.mesh->vertices.size()) <= kScanAtMost) {
    return direction.dot(support(direction));
  }
  const int i = scan_vertices(*shape.mesh, X.rotation.transpose() * direction, hint);
  return direction.dot(X * shape.mesh->vertices[i]);
}

Vector3 CoreShape::center() const {
  return shape.type == ShapeType::kConvexMesh ? X * shape.mesh->interior_point : X.translation;
}

double CoreShape::extent() const {
  switch (shape.type) {
    case ShapeType::kCapsule:
      return shape.size[1];
    case ShapeType::kBox:
      return shape.size.norm();
    case ShapeType::kCylinder:
      return shape.size[0] + shape.size[1];
    case ShapeType::kConvexMesh:
      return shape.mesh->radius;
    case ShapeType::kSphere:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return 0.0;
}

}  // namespace counterpoint::collision
