#include "counterpoint/collision/shapes/enclosure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/model/terrain/terrain.h"

namespace counterpoint::collision {
namespace {

Enclosure enclose_hull(const ConvexMesh& mesh) {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const Vector3& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  Enclosure out{0.5 * (low + high), 0.5 * (high - low), 0.0,
                std::numeric_limits<double>::infinity()};
  for (const Vector3& v : mesh.vertices) out.radius = std::max(out.radius, (v - out.center).norm());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    out.thickness = std::min(
        out.thickness, mesh.face_offsets[f] - mesh.face_normals[f].dot(mesh.interior_point));
  }
  return out;
}

}  // namespace

Enclosure enclose(const Shape& shape) {
  const Vector3 zero = Vector3::Zero();
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane: break;
    case ShapeType::kSphere: return {zero, Vector3::Constant(s[0]), s[0], s[0]};
    case ShapeType::kBox: return {zero, s, s.norm(), s.minCoeff()};
    case ShapeType::kCapsule: return {zero, {s[0], s[0], s[0] + s[1]}, s[0] + s[1], s[0]};
    case ShapeType::kCylinder:
      return {zero, {s[0], s[0], s[1]}, std::hypot(s[0], s[1]), std::min(s[0], s[1])};
    case ShapeType::kConvexMesh: return enclose_hull(*shape.mesh);
    case ShapeType::kTerrain: {
      const Vector3 half = 0.5 * (shape.terrain->high - shape.terrain->low);
      return {shape.terrain->low + half, half, half.norm(), 0.0};
    }
  }
  return {};
}

Bounds bounds(ShapeType type, const Enclosure& enclosure, const Pose& X, double margin) {
  const Vector3 center = X * enclosure.center;
  Vector3 half;
  if (type == ShapeType::kSphere) {
    half = enclosure.half;
  } else if (type == ShapeType::kCapsule) {
    const double radius = enclosure.half.x();
    half = ((enclosure.half.z() - radius) * X.rotation.col(2)).cwiseAbs().array() + radius;
  } else {
    half = (X.rotation.cwiseAbs() * enclosure.half).cwiseMin(enclosure.radius);
  }
  half.array() += margin;
  return {center - half, center + half};
}

}  // namespace counterpoint::collision
