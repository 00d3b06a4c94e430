#include "counterpoint/collision/shapes/enclosure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/model/geometry.h"

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
    out.thickness = std::min(out.thickness,
                             mesh.face_offsets[f] - mesh.face_normals[f].dot(mesh.interior_point));
  }
  return out;
}

}  // namespace

namespace {

/// Relative to the sizes: larger than the error of the narrow phase's distances.
constexpr double kDistanceError = 1e-8;

/// Returns how far the shape reaches from its centre along the unit vector n, in either direction
/// [m].
double reach_along(const Enclosure& e, const Pose& X, const Vector3& n) {
  return std::min(e.radius, (X.rotation.transpose() * n).cwiseAbs().dot(e.half));
}

}  // namespace

double separation(const Enclosure& a, const Pose& X_WA, const Enclosure& b, const Pose& X_WB) {
  const Vector3 apart = X_WB * b.center - X_WA * a.center;
  const double distance = apart.norm();
  if (!(distance > 0.0)) return 0.0;
  const Vector3 line = apart / distance;
  double most = distance - reach_along(a, X_WA, line) - reach_along(b, X_WB, line);
  // Along an axis of one box: its own half width, and the reach of the other.
  const Matrix3 turn = (X_WA.rotation.transpose() * X_WB.rotation).cwiseAbs();
  const Vector3 along_a =
      (X_WA.rotation.transpose() * apart).cwiseAbs() - a.half - (turn * b.half).cwiseMin(b.radius);
  const Vector3 along_b = (X_WB.rotation.transpose() * apart).cwiseAbs() - b.half -
                          (turn.transpose() * a.half).cwiseMin(a.radius);
  most = std::max({most, along_a.maxCoeff(), along_b.maxCoeff()});
  return most - kDistanceError * (distance + a.radius + b.radius);
}

double height_above(const Pose& X_WP, const Enclosure& b, const Pose& X_WB) {
  const Vector3 normal = X_WP.rotation.col(2);
  const Vector3 apart = X_WB * b.center - X_WP.translation;
  return normal.dot(apart) - reach_along(b, X_WB, normal) -
         kDistanceError * (apart.norm() + b.radius);
}

Enclosure enclose(const Shape& shape) {
  const Vector3 zero = Vector3::Zero();
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane:
      break;
    case ShapeType::kSphere:
      return {zero, Vector3::Constant(s[0]), s[0], s[0]};
    case ShapeType::kBox:
      return {zero, s, s.norm(), s.minCoeff()};
    case ShapeType::kCapsule:
      return {zero, {s[0], s[0], s[0] + s[1]}, s[0] + s[1], s[0]};
    case ShapeType::kCylinder:
      return {zero, {s[0], s[0], s[1]}, std::hypot(s[0], s[1]), std::min(s[0], s[1])};
    case ShapeType::kConvexMesh:
      return enclose_hull(*shape.mesh);
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
