#include "counterpoint/collision/pairs/corner_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/shapes/core_shape.h"

namespace counterpoint::collision {
namespace {

// A shape larger than this many times the travel does not turn enough for other corners to matter.
constexpr double kLargestRatio = 4.0;
// Relative to the shape's size: contacts closer together count as one.
constexpr double kSamePlace = 0.05;

}  // namespace

Corners corners_of(const Shape& shape) {
  Corners out;
  const Vector3& s = shape.size;
  const auto sign = [](int i) {
    return Vector3(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
  };
  switch (shape.type) {
    case ShapeType::kBox:
      for (int i = 0; i < 8; ++i) out.points[out.size++] = sign(i).cwiseProduct(s);
      break;
    case ShapeType::kCapsule:
      out.radius = s[0];
      for (const double end : {-1.0, 1.0}) out.points[out.size++] = {0.0, 0.0, end * s[1]};
      break;
    case ShapeType::kCylinder:
      for (const double end : {-1.0, 1.0}) {
        for (const double side : {-1.0, 1.0}) {
          out.points[out.size++] = {side * s[0], 0.0, end * s[1]};
          out.points[out.size++] = {0.0, side * s[0], end * s[1]};
        }
      }
      break;
    case ShapeType::kConvexMesh:
      for (int i = 0; i < 8; ++i)
        out.points[out.size++] = shape.mesh->vertices[support_vertex(
            *shape.mesh, sign(i), likely_vertex(*shape.mesh, sign(i)))];
      break;
    case ShapeType::kSphere:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  Vector3 center = Vector3::Zero();
  for (int i = 0; i < out.size; ++i) center += out.points[i] / out.size;
  for (int i = 0; i < out.size; ++i)
    out.extent = std::max(out.extent, (out.points[i] - center).norm() + out.radius);
  return out;
}

namespace {

// Returns an upper bound of n . x over the points x of the shape, for a unit vector n [m].
double reach_along(const CorneredShape& s, const Vector3& n) {
  constexpr double kError = 1e-8;  // relative; larger than the error of distances
  const CoreShape core(s.shape, s.X);
  return core.scan_support(n) + core.radius + kError * (s.corners.extent + s.X.translation.norm());
}

// Adds the contacts of the corners of `of` with `other`. sign: 1 if the corners belong to A, else
// -1.
void add_corners(const CorneredShape& of, const CorneredShape& other, double sign, double margin,
                 const Vector3& normal, Manifold& manifold) {
  const Corners& corners = of.corners;
  const Shape ball{ShapeType::kSphere, Vector3(corners.radius, 0.0, 0.0), nullptr};
  const double same = kSamePlace * corners.extent;
  // Corners up to this height along the direction to the other shape are beyond the margin.
  const Vector3 towards = sign * normal;
  const double low = -reach_along(other, -towards) - margin - corners.radius;
  for (int i = 0; i < corners.size; ++i) {
    const Vector3 place = of.X * corners.points[i];
    if (towards.dot(place) <= low) continue;
    Manifold contact;
    pair_contacts(ball, {Matrix3::Identity(), place}, other.shape, other.X, margin, contact);
    if (contact.size == 0) continue;
    ContactPoint& p = contact.points[0];
    p.normal *= sign;
    if (p.normal.dot(normal) <= 0.0) continue;
    const auto on_shape = [&](const ContactPoint& c) {
      return Vector3(c.position - sign * 0.5 * c.gap * c.normal);
    };
    const Vector3 touched = on_shape(p);
    const bool known =
        std::any_of(manifold.points.begin(), manifold.points.begin() + manifold.size,
                    [&](const ContactPoint& c) { return (on_shape(c) - touched).norm() < same; });
    if (!known) manifold.add(p.position, p.normal, p.gap);
  }
}

// True for planes and terrain, whose manifolds contain every corner within the margin.
bool is_ground(const Shape& shape) {
  return shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain;
}

}  // namespace

void add_corner_contacts(const CorneredShape& a, const CorneredShape& b, double margin,
                         double travel, Manifold& manifold) {
  if (manifold.size == 0 || is_ground(a.shape) || is_ground(b.shape)) return;
  double least = std::numeric_limits<double>::infinity();
  Vector3 normal = Vector3::UnitZ();
  for (int i = 0; i < manifold.size; ++i) {
    if (manifold.points[i].gap >= least) continue;
    least = manifold.points[i].gap;
    normal = manifold.points[i].normal;
  }
  if (least <= 0.0) return;
  const double largest = kLargestRatio * travel;
  if (a.corners.extent <= largest) add_corners(a, b, 1.0, margin, normal, manifold);
  if (b.corners.extent <= largest) add_corners(b, a, -1.0, margin, normal, manifold);
}

std::optional<CoreBall> core_ball(const Shape& shape, const Enclosure& enclosure, const Pose& X,
                                  double travel) {
  // Largest ratio of half thickness to bounding radius of a slender or flat shape; a cube has 0.58.
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
  const Corners corners = corners_of(shape);
  const Shape ball{ShapeType::kSphere, Vector3(corners.radius, 0.0, 0.0), nullptr};
  for (int i = 0; i < corners.size; ++i)
    out.balls[out.size++] = {ball, {Matrix3::Identity(), X * corners.points[i]}};
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
