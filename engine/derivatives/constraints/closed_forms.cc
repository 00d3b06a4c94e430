#include "counterpoint/engine/derivatives/constraints/closed_forms.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// Whether p (shape frame) is a core point: fixed in the shape, and the centre of a ball that can
/// touch a plane (radius core_radius).
bool is_core(const Shape& shape, const Vector3& p) {
  const Vector3& size = shape.size;
  switch (shape.type) {
    case ShapeType::kSphere:
      return p.norm() < kSamePlace * size.x();
    case ShapeType::kCapsule:
      return (p.cwiseAbs() - Vector3(0, 0, size.y())).norm() < kSamePlace * (size.x() + size.y());
    case ShapeType::kBox:
      return (p.cwiseAbs() - size).norm() < kSamePlace * size.norm();
    case ShapeType::kConvexMesh: {
      const double near = kSamePlace * shape.mesh->radius;
      return std::any_of(shape.mesh->vertices.begin(), shape.mesh->vertices.end(),
                         [&](const Vector3& v) { return (v - p).squaredNorm() < near * near; });
    }
    default:
      return false;
  }
}

double core_radius(const Shape& shape) {
  return shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule ? shape.size.x()
                                                                               : 0.0;
}

}  // namespace

bool touches_plane(const Shape& solid, const Pose& X_WG, const collision::Candidate& contact,
                   double towards_b, double side, ContactMotion& out) {
  const Vector3& n = contact.normal;
  const double open = contact.gap > 0.0 ? 1.0 : 0.0;
  // The contact place lies `offset` from the core point, towards the plane.
  const double by_gap = 0.5 + side * towards_b * open;
  const double offset = core_radius(solid) + by_gap * contact.gap;
  if (!is_core(solid, X_WG.inverse() * (contact.position - side * offset * n))) return false;
  const Matrix3 turned = -offset * skew(n), along = n * n.transpose();
  out.gap << Vector3::Zero().transpose(), n.transpose();
  out.point.leftCols<3>() = turned;
  if (side < 0.0) {  // a displacement of B moves the core; the plane and its normal stay
    out.point.rightCols<3>() = Matrix3::Identity() - by_gap * along;
    out.normal.setZero();
  } else {
    out.point.rightCols<3>() = by_gap * along;
    out.normal << -skew(n), Matrix3::Zero();
  }
  return true;
}

namespace {

/// A ball about a point, or about every point of a segment along `axis`.
struct Round {
  Vector3 center, axis;
  double half, radius;

  Round(const Shape& shape, const Pose& X)
      : center(X.translation),
        axis(X.rotation.col(2)),
        half(shape.type == ShapeType::kCapsule ? shape.size.y() : 0.0),
        radius(shape.size.x()) {}

  bool holds(const Vector3& p) const {
    const double along = axis.dot(p - center), size = half + radius;
    return (p - center - along * axis).norm() < kSamePlace * size &&
           std::abs(along) < half + kSamePlace * size;
  }
  /// Whether the closest point p slides along the segment, n being perpendicular to it. Otherwise
  /// it is an end point, or held in another way.
  bool slides(const Vector3& p, const Vector3& n) const {
    return std::abs(axis.dot(p - center)) < half - kSamePlace * (half + radius) &&
           std::abs(axis.dot(n)) < 1e-7;
  }
};

bool is_round(const Shape& shape) {
  return shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule;
}

}  // namespace

bool rounds_touch(const Shape& shape_a, const Pose& X_WA, const Shape& shape_b, const Pose& X_WB,
                  const collision::Candidate& contact, double towards_b, ContactMotion& out) {
  if (!is_round(shape_a) || !is_round(shape_b)) return false;
  const Round a(shape_a, X_WA), b(shape_b, X_WB);
  const Vector3 middle = contact.position - towards_b * std::max(contact.gap, 0.0) * contact.normal;
  const Vector3& n = contact.normal;
  const double distance = contact.gap + a.radius + b.radius;
  const double to_a = a.radius + 0.5 * contact.gap;
  const Vector3 at_a = middle - to_a * n, at_b = middle + (b.radius + 0.5 * contact.gap) * n;
  if (!(distance > kSamePlace * (a.radius + b.radius)) || !a.holds(at_a) || !b.holds(at_b))
    return false;
  using Row6 = Eigen::Matrix<double, 1, 6>;
  Eigen::Matrix<double, 3, 6> apart;  // change of c_B - c_A
  apart << -skew(at_b - contact.position), Matrix3::Identity();
  out.gap = n.transpose() * apart;
  Row6 s = Row6::Zero(), t = Row6::Zero();  // changes of the positions along the segments
  const bool a_slides = a.slides(at_a, n), b_slides = b.slides(at_b, n);
  if (a_slides) s = a.axis.transpose() * apart;
  if (b_slides) {
    t = -b.axis.transpose() * apart;
    t.head<3>() -= distance * b.axis.cross(n).transpose();
  }
  if (a_slides && b_slides) {
    const double cosine = a.axis.dot(b.axis), sine2 = 1.0 - cosine * cosine;
    if (!(sine2 > kSamePlace)) return false;
    const Row6 both = (s + cosine * t) / sine2;
    t = (t + cosine * s) / sine2;
    s = both;
  }
  apart += b.axis * t - a.axis * s;
  out.normal = (apart - n * (n.transpose() * apart)) / distance;
  const double open = contact.gap > 0.0 ? towards_b : 0.0;
  out.point = a.axis * s + (to_a + open * contact.gap) * out.normal + (0.5 + open) * n * out.gap;
  return true;
}

}  // namespace counterpoint
