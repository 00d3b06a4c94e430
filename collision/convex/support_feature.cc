#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/shapes/core_shape.h"

namespace counterpoint::collision {
namespace {

void segment_feature(const Vector3& center, const Vector3& half, double radius, Feature& out) {
  out.size = 0;
  out.radius = radius;
  out.round = false;
  out.add(center - half);
  out.add(center + half);
}

// Cosine between direction and axis from which a cylinder's feature is its cap, else its side.
constexpr double kCapCosine = 0.7;

// Sets the cap, as a polygon whose first corner is the rim's farthest point along the direction, or
// the side, as the line farthest along it.
void cylinder_feature(const Shape& cylinder, const Pose& X, const Vector3& direction,
                      Feature& out) {
  const Vector3 local = X.rotation.transpose() * direction;
  const double radial = std::sqrt(local.x() * local.x() + local.y() * local.y());
  // Within round-off of the rotation the radial direction is noise.
  const double cosine = radial > 1e-14 ? local.x() / radial : 1.0;
  const double sine = radial > 1e-14 ? local.y() / radial : 0.0;
  const double radius = cylinder.size[0];
  if (std::abs(local.z()) < kCapCosine) {
    segment_feature(X * Vector3(radius * cosine, radius * sine, 0.0),
                    cylinder.size[1] * X.rotation.col(2), 0.0, out);
    return;
  }
  const double sign = local.z() < 0.0 ? -1.0 : 1.0;
  out.size = 0;
  out.radius = 0.0;
  out.round = true;
  out.normal = sign * X.rotation.col(2);
  for (int i = 0; i < Feature::kCapacity; ++i) {
    const double angle = sign * (2.0 * std::numbers::pi / Feature::kCapacity) * i;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    out.add(X * Vector3(radius * (cosine * c - sine * s), radius * (sine * c + cosine * s),
                        sign * cylinder.size[1]));
  }
}

}  // namespace

void mesh_face(const ConvexMesh& mesh, int face, const Pose& X, Feature& out) {
  const std::vector<int>& corners = mesh.faces[face];
  const std::size_t used = std::min<std::size_t>(corners.size(), Feature::kCapacity);
  out.size = 0;
  out.radius = 0.0;
  out.round = false;
  out.normal = X.rotation * mesh.face_normals[face];
  for (std::size_t i = 0; i < used; ++i)
    out.add(X * mesh.vertices[corners[i * corners.size() / used]]);
}

void support_feature(const Shape& shape, const Pose& X, const Vector3& direction, int vertex,
                     Feature& out) {
  switch (shape.type) {
    case ShapeType::kBox:
      box_feature(shape, X, direction, out);
      return;
    case ShapeType::kCylinder:
      cylinder_feature(shape, X, direction, out);
      return;
    case ShapeType::kConvexMesh:
      mesh_face(*shape.mesh, support_face(*shape.mesh, X.rotation.transpose() * direction, vertex),
                X, out);
      return;
    case ShapeType::kCapsule:
      segment_feature(X.translation, shape.size[1] * X.rotation.col(2), shape.size[0], out);
      return;
    case ShapeType::kSphere:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      out.size = 1;
      out.round = false;
      out.vertices[0] = X.translation;
      out.radius = shape.type == ShapeType::kSphere ? shape.size[0] : 0.0;
      return;
  }
}

}  // namespace counterpoint::collision
