#include "counterpoint/collision/core_shape.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace counterpoint::collision {

namespace {

// With no more vertices than this looking at all is faster than climbing.
constexpr int kScanAtMost = 128;

using Four = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));

Four load(const float* p) { return Four{p[0], p[1], p[2], p[3]}; }
Four larger(const Four& a, const Four& b) { return a > b ? a : b; }
Four smaller(const Four& a, const Four& b) { return a < b ? a : b; }

// The vertex farthest along the direction, of equals the lowest.
int scan_all(const ConvexMesh& mesh, const Vector3& direction) {
  int best = 0;
  double height = mesh.vertices[0].dot(direction);
  for (int i = 1; i < static_cast<int>(mesh.vertices.size()); ++i) {
    const double h = mesh.vertices[i].dot(direction);
    if (h > height) {
      height = h;
      best = i;
    }
  }
  return best;
}

// The same for at most kScanAtMost vertices, in single precision unless the second is close. The
// last bits of a height hold the vertex, so that the largest brings its own along.
int scan_few(const ConvexMesh& mesh, const Vector3& direction) {
  static_assert(kScanAtMost == 128);
  constexpr std::int32_t kVertex = kScanAtMost - 1;
  // Vertices and direction are at most 1 long. The six roundings of a product lose 4e-7, the bits
  // that hold the vertex 1.6e-5.
  constexpr float kClose = 4e-5f;
  const double inverse_length = 1.0 / direction.cwiseAbs().sum();
  const auto x = static_cast<float>(direction.x() * inverse_length);
  const auto y = static_cast<float>(direction.y() * inverse_length);
  const auto z = static_cast<float>(direction.z() * inverse_length);
  const float* const xs = mesh.coarse_vertices[0].data();
  const float* const ys = mesh.coarse_vertices[1].data();
  const float* const zs = mesh.coarse_vertices[2].data();
  const int size = static_cast<int>(mesh.vertices.size());
  Four first = {-2.0f, -2.0f, -2.0f, -2.0f};
  Four second = first;
  FourInts vertices = {0, 1, 2, 3};
  for (int i = 0; i < size; i += 4, vertices += 4) {
    const Four height = load(xs + i) * x + load(ys + i) * y + load(zs + i) * z;
    const auto tagged =
        reinterpret_cast<Four>((reinterpret_cast<FourInts>(height) & ~kVertex) | vertices);
    second = larger(second, smaller(first, tagged));
    first = larger(first, tagged);
  }
  const float first01 = std::max(first[0], first[1]);
  const float first23 = std::max(first[2], first[3]);
  const float highest = std::max(first01, first23);
  const float next =
      std::max({std::min(first01, first23), std::min(first[0], first[1]),
                std::min(first[2], first[3]), second[0], second[1], second[2], second[3]});
  // False also for a direction that is not finite or zero.
  if (highest - next > kClose) return std::bit_cast<std::int32_t>(highest) & kVertex;
  return scan_all(mesh, direction);
}

}  // namespace

int scan_vertices(const ConvexMesh& mesh, const Vector3& direction) {
  return static_cast<int>(mesh.vertices.size()) <= kScanAtMost ? scan_few(mesh, direction)
                                                               : scan_all(mesh, direction);
}

int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start) {
  if (static_cast<int>(mesh.vertices.size()) <= kScanAtMost) {
    return scan_few(mesh, direction);
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
      hint = scan ? scan_vertices(*shape.mesh, local) : support_vertex(*shape.mesh, local, hint);
      return X * shape.mesh->vertices[hint];
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return X.translation;
}

bool CoreShape::climbs() const {
  return shape.type == ShapeType::kConvexMesh &&
         static_cast<int>(shape.mesh->vertices.size()) > kScanAtMost;
}

double CoreShape::scan_support(const Vector3& direction) const {
  if (!climbs()) return direction.dot(support(direction));
  const int i = scan_vertices(*shape.mesh, X.rotation.transpose() * direction);
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
