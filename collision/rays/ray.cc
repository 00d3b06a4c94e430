// A ray against a convex shape: the shape cuts an interval out of the ray's line, and the ray hits
// where the interval begins.
#include "counterpoint/collision/rays/ray.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/collision/collider.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::collision {
namespace {

// The line of the ray in the frame of the shape.
struct Line {
  Vector3 origin, direction;  // direction: unit length
  Vector3 at(double t) const { return origin + t * direction; }
};

// The interval of line parameters t [m] inside a convex set, and the outward normal where it
// begins.
struct Stretch {
  double enter = -kInfinity, exit = kInfinity;
  Vector3 normal = Vector3::Zero();

  bool empty() const { return !(enter <= exit); }
  // Intersects with the half-space normal . x <= offset.
  void cut(const Line& line, const Vector3& outward, double offset) {
    const double height = outward.dot(line.origin) - offset;
    const double rate = outward.dot(line.direction);
    if (rate == 0.0) {
      if (height > 0.0) exit = -kInfinity;
      return;
    }
    const double t = -height / rate;
    if (rate > 0.0) {
      exit = std::min(exit, t);
    } else if (t > enter) {
      enter = t;
      normal = outward;
    }
  }
  // Intersects with another interval.
  void cut(const Stretch& other) {
    if (other.enter > enter) {
      enter = other.enter;
      normal = other.normal;
    }
    exit = std::min(exit, other.exit);
  }
  // Unites with another interval, where the union is convex.
  void join(const Stretch& other) {
    if (other.empty()) return;
    if (empty()) {
      *this = other;
      return;
    }
    if (other.enter < enter) {
      enter = other.enter;
      normal = other.normal;
    }
    exit = std::max(exit, other.exit);
  }
};

Stretch nothing() { return {kInfinity, -kInfinity, Vector3::Zero()}; }

// Computed from the point of closest approach, not from the quadratic's discriminant, to keep
// digits for distant rays.
Stretch ball(const Line& line, const Vector3& center, double radius) {
  const double middle = line.direction.dot(center - line.origin);
  const double half2 = radius * radius - (line.at(middle) - center).squaredNorm();
  if (half2 < 0.0) return nothing();
  const double half = std::sqrt(half2);
  const Vector3 out = line.at(middle - half) - center;
  return {middle - half, middle + half,
          radius > 0.0 ? Vector3(out / out.norm()) : Vector3(-line.direction)};
}

// Interval inside the infinite cylinder about the z axis.
Stretch tube(const Line& line, double radius) {
  const double slope2 = line.direction.head<2>().squaredNorm();
  const double away2 = line.origin.head<2>().squaredNorm();
  if (slope2 == 0.0) return away2 <= radius * radius ? Stretch{} : nothing();
  const double middle = -line.direction.head<2>().dot(line.origin.head<2>()) / slope2;
  const double half2 = radius * radius - line.at(middle).head<2>().squaredNorm();
  if (half2 < 0.0) return nothing();
  const double half = std::sqrt(half2 / slope2);
  Vector3 out = line.at(middle - half);
  out.z() = 0.0;
  return {middle - half, middle + half,
          radius > 0.0 ? Vector3(out / out.norm()) : Vector3(-line.direction)};
}

Stretch slab(const Line& line, int axis, double half) {
  Stretch s;
  s.cut(line, Vector3::Unit(axis), half);
  s.cut(line, -Vector3::Unit(axis), half);
  return s;
}

Stretch stretch(const Line& line, const Shape& shape) {
  const Vector3& size = shape.size;
  Stretch s;
  switch (shape.type) {
    case ShapeType::kPlane:
      s.cut(line, Vector3::UnitZ(), 0.0);
      break;
    case ShapeType::kSphere:
      s = ball(line, Vector3::Zero(), size[0]);
      break;
    case ShapeType::kBox:
      for (int i = 0; i < 3; ++i) s.cut(slab(line, i, size[i]));
      break;
    case ShapeType::kCapsule:
      s = tube(line, size[0]);
      s.cut(slab(line, 2, size[1]));
      s.join(ball(line, {0.0, 0.0, -size[1]}, size[0]));
      s.join(ball(line, {0.0, 0.0, size[1]}, size[0]));
      break;
    case ShapeType::kCylinder:
      s = tube(line, size[0]);
      s.cut(slab(line, 2, size[1]));
      break;
    case ShapeType::kConvexMesh: {
      const ConvexMesh& mesh = *shape.mesh;
      if (ball(line, mesh.interior_point, mesh.radius).empty()) return nothing();
      for (std::size_t i = 0; i < mesh.faces.size() && !s.empty(); ++i) {
        s.cut(line, mesh.face_normals[i], mesh.face_offsets[i]);
      }
      break;
    }
    case ShapeType::kTerrain:
      return nothing();  // not convex: see cast_terrain_ray
  }
  return s;
}

}  // namespace

std::optional<RayHit> cast_unit_ray(const Shape& shape, const Pose& X_WS, const Vector3& origin,
                                    const Vector3& direction, double max_distance) {
  const Matrix3& R = X_WS.rotation;
  const Line line{R.transpose() * (origin - X_WS.translation), R.transpose() * direction};
  if (shape.type == ShapeType::kTerrain) {
    std::optional<RayHit> hit =
        cast_terrain_ray(*shape.terrain, line.origin, line.direction, max_distance);
    if (hit) *hit = {hit->distance, X_WS * hit->position, R * hit->normal};
    return hit;
  }
  const Stretch s = stretch(line, shape);
  if (s.empty() || s.exit < 0.0 || !(s.enter <= max_distance)) return std::nullopt;
  if (s.enter < 0.0) return RayHit{0.0, origin, -direction};
  return RayHit{s.enter, origin + s.enter * direction, R * s.normal};
}

}  // namespace counterpoint::collision
