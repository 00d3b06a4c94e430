#include "counterpoint/collision/pairs/corner_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/shapes/core_shape.h"

namespace counterpoint::collision {
namespace {

// A shape this many times larger than the travel does not turn far enough for other corners to
// matter.
constexpr double kLargestRatio = 4.0;
// Contacts closer together than this share of the shape's size are one.
constexpr double kSamePlace = 0.05;

struct Corners {
  std::array<Vector3, 8> points;  // in W
  int size = 0;
  double radius = 0.0;
  double extent = 0.0;  // distance of the farthest corner from the shape's centre [m]
};

Corners corners_of(const Shape& shape, const Pose& X) {
  Corners out;
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kBox:
      for (int i = 0; i < 8; ++i) {
        const Vector3 sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
        out.points[out.size++] = X * sign.cwiseProduct(s);
      }
      break;
    case ShapeType::kCapsule:
      out.radius = s[0];
      for (const double end : {-1.0, 1.0}) {
        out.points[out.size++] = X * Vector3(0.0, 0.0, end * s[1]);
      }
      break;
    case ShapeType::kCylinder:
      for (const double end : {-1.0, 1.0}) {
        for (const double side : {-1.0, 1.0}) {
          out.points[out.size++] = X * Vector3(side * s[0], 0.0, end * s[1]);
          out.points[out.size++] = X * Vector3(0.0, side * s[0], end * s[1]);
        }
      }
      break;
    case ShapeType::kConvexMesh:
      for (int i = 0; i < 8; ++i) {
        const Vector3 way(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
        out.points[out.size++] =
            X *
            shape.mesh->vertices[support_vertex(*shape.mesh, way, likely_vertex(*shape.mesh, way))];
      }
      break;
    case ShapeType::kSphere:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  Vector3 center = Vector3::Zero();
  for (int i = 0; i < out.size; ++i) center += out.points[i] / out.size;
  for (int i = 0; i < out.size; ++i) {
    out.extent = std::max(out.extent, (out.points[i] - center).norm() + out.radius);
  }
  return out;
}

// A lower bound of Corners::extent [m].
double least_extent(const Shape& shape) {
  constexpr double kRoundoff = 1.0 - 1e-9;
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kBox:
      return kRoundoff * s.norm();
    case ShapeType::kCapsule:
      return kRoundoff * (s[0] + s[1]);
    case ShapeType::kCylinder:
      return kRoundoff * std::hypot(s[0], s[1]);
    case ShapeType::kConvexMesh:
      // The farthest vertex, at R, is at least R / sqrt(3) along one of the eight ways, and the
      // corner along the opposite one is below the interior point: the two are so far apart.
      return kRoundoff * shape.mesh->radius / (2.0 * std::numbers::sqrt3);
    case ShapeType::kSphere:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return 0.0;
}

// `sign` turns the normals: 1 where the corners belong to A.
void add_corners(const Shape& shape, const Pose& X, const Shape& other, const Pose& X_other,
                 double sign, double margin, double travel, const Vector3& normal,
                 Manifold& manifold) {
  if (least_extent(shape) > kLargestRatio * travel) return;
  const Corners corners = corners_of(shape, X);
  if (corners.extent > kLargestRatio * travel) return;
  const Shape ball{ShapeType::kSphere, Vector3(corners.radius, 0.0, 0.0), nullptr};
  const double same = kSamePlace * corners.extent;
  for (int i = 0; i < corners.size; ++i) {
    Manifold contact;
    pair_contacts(ball, {Matrix3::Identity(), corners.points[i]}, other, X_other, margin, contact);
    if (contact.size == 0) continue;
    ContactPoint& p = contact.points[0];
    p.normal *= sign;
    if (p.normal.dot(normal) <= 0.0) continue;
    const auto on_shape = [&](const ContactPoint& c) {
      return Vector3(c.position - sign * 0.5 * c.gap * c.normal);
    };
    const Vector3 place = on_shape(p);
    const bool known =
        std::any_of(manifold.points.begin(), manifold.points.begin() + manifold.size,
                    [&](const ContactPoint& c) { return (on_shape(c) - place).norm() < same; });
    if (!known) manifold.add(p.position, p.normal, p.gap);
  }
}

// Their manifolds hold every corner within the margin.
bool is_ground(const Shape& shape) {
  return shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain;
}

}  // namespace

void add_corner_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                         double margin, double travel, Manifold& manifold) {
  if (manifold.size == 0 || is_ground(a) || is_ground(b)) return;
  double least = std::numeric_limits<double>::infinity();
  Vector3 normal = Vector3::UnitZ();
  for (int i = 0; i < manifold.size; ++i) {
    if (manifold.points[i].gap >= least) continue;
    least = manifold.points[i].gap;
    normal = manifold.points[i].normal;
  }
  if (least <= 0.0) return;
  add_corners(a, X_WA, b, X_WB, 1.0, margin, travel, normal, manifold);
  add_corners(b, X_WB, a, X_WA, -1.0, margin, travel, normal, manifold);
}

std::optional<CoreBall> core_ball(const Shape& shape, const Enclosure& enclosure, const Pose& X,
                                  double travel) {
  // Of a cube the ball takes 0.58 of the way to the corners.
  constexpr double kCompact = 0.5;
  if (enclosure.radius > kLargestRatio * travel || is_ground(shape) ||
      enclosure.thickness > kCompact * enclosure.radius) {
    return std::nullopt;
  }
  const Vector3 middle = shape.mesh ? shape.mesh->interior_point : Vector3(Vector3::Zero());
  return CoreBall{{ShapeType::kSphere, Vector3(enclosure.thickness, 0.0, 0.0), nullptr},
                  {Matrix3::Identity(), X * middle}};
}

StandIns stand_ins(const Shape& shape, const Pose& X) {
  StandIns out;
  const Corners corners = corners_of(shape, X);
  const Shape ball{ShapeType::kSphere, Vector3(corners.radius, 0.0, 0.0), nullptr};
  for (int i = 0; i < corners.size; ++i)
    out.balls[out.size++] = {ball, {Matrix3::Identity(), corners.points[i]}};
  if (const auto core =
          core_ball(shape, enclose(shape), X, std::numeric_limits<double>::infinity()))
    out.balls[out.size++] = *core;
  return out;
}

void find_core_contact(const CoreBall& ball, const Shape& b, const Pose& X_WB, double margin,
                       Manifold& out) {
  pair_contacts(ball.shape, ball.X, b, X_WB, margin, out);
  if (out.size > 0 && b.type != ShapeType::kPlane && out.points[0].gap <= -ball.shape.size[0]) {
    out.size = 0;
  }
}

}  // namespace counterpoint::collision
