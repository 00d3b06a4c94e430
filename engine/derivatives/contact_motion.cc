#include "counterpoint/engine/derivatives/contact_motion.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/collision/pair_contacts.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint {
namespace {

/// Relative to the shapes' size: what lies closer together is one.
constexpr double kSame = 1e-9;
/// The difference step, relative to the smallest length of the two shapes; as an angle [rad].
constexpr double kStep = 1e-5;
/// A neighbouring contact is at most so many difference steps away (rims of cylinders slide fast).
constexpr double kFarthest = 1e3;

/// A point of a shape which keeps its place in it and, as the centre of a ball, touches a plane.
bool is_core(const Shape& shape, const Vector3& p) {
  const Vector3& size = shape.size;
  switch (shape.type) {
    case ShapeType::kSphere:
      return p.norm() < kSame * size.x();
    case ShapeType::kCapsule:
      return (p.cwiseAbs() - Vector3(0, 0, size.y())).norm() < kSame * (size.x() + size.y());
    case ShapeType::kBox:
      return (p.cwiseAbs() - size).norm() < kSame * size.norm();
    case ShapeType::kConvexMesh: {
      const double near = kSame * shape.mesh->radius;
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

/// A solid's core point against a plane. side: -1 if the plane is A's, 1 if it is B's.
bool touches_plane(const Shape& solid, const Pose& X_WG, const collision::Candidate& contact,
                   double towards_b, double side, ContactMotion& out) {
  const Vector3& n = contact.normal;
  const double open = contact.gap > 0.0 ? 1.0 : 0.0;
  // The place is `offset` away from the core, on the side of the plane.
  const double by_gap = 0.5 + side * towards_b * open;
  const double offset = core_radius(solid) + by_gap * contact.gap;
  if (!is_core(solid, X_WG.inverse() * (contact.position - side * offset * n))) return false;
  const Matrix3 turned = -offset * skew(n), along = n * n.transpose();
  out.gap << Vector3::Zero().transpose(), n.transpose();
  out.point.leftCols<3>() = turned;
  if (side < 0.0) {  // the plane and its normal stay, the core moves
    out.point.rightCols<3>() = Matrix3::Identity() - by_gap * along;
    out.normal.setZero();
  } else {
    out.point.rightCols<3>() = by_gap * along;
    out.normal << -skew(n), Matrix3::Zero();
  }
  return true;
}

double smallest_length(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      return std::numeric_limits<double>::infinity();
    case ShapeType::kConvexMesh:
      return 0.1 * shape.mesh->radius;
    case ShapeType::kSphere:
      return shape.size.x();
    case ShapeType::kCapsule:
    case ShapeType::kCylinder:
      return std::min(shape.size.x(), std::max(shape.size.y(), 0.1 * shape.size.x()));
    case ShapeType::kBox:
      return shape.size.minCoeff();
  }
  return 1.0;
}

/// The contacts of two shapes as one of them moves.
class MovingPair {
 public:
  MovingPair(const Geometry& a, const Geometry& b, const Data& data,
             const collision::Candidate& contact)
      : a_(a.shape),
        b_(b.shape),
        X_WA_(data.X_WB[a.body] * a.X_BG),
        X_WB_(data.X_WB[b.body] * b.X_BG),
        at_(contact.position),
        // Some more room, so that a contact does not vanish at the margin.
        query_(std::abs(contact.gap) +
               smallest_length(a.shape.type == ShapeType::kPlane ? b.shape : a.shape)) {}

  /// The contact closest to `expected`, if that is closer than `most` [m].
  const collision::ContactPoint* find(const Pose& X_WB, const Vector3& expected, double most) {
    collision::pair_contacts(a_, X_WA_, b_, X_WB, query_, manifold_);
    const collision::ContactPoint* best = nullptr;
    double least = most * most;
    for (int i = 0; i < manifold_.size; ++i) {
      const double distance = (manifold_.points[i].position - expected).squaredNorm();
      if (distance > least) continue;
      least = distance;
      best = &manifold_.points[i];
    }
    return best;
  }

  const Pose& pose() const { return X_WB_; }
  /// B moved by a small twist (column 0 ... 5) about the contact.
  Pose moved(int column, double by) const {
    if (column >= 3) return {X_WB_.rotation, X_WB_.translation + by * Vector3::Unit(column - 3)};
    const Matrix3 turn = quaternion_exp(by * Vector3::Unit(column)).toRotationMatrix();
    return {turn * X_WB_.rotation, at_ + turn * (X_WB_.translation - at_)};
  }

 private:
  const Shape& a_;
  const Shape& b_;
  Pose X_WA_, X_WB_;
  Vector3 at_;
  collision::PairQuery query_;
  collision::Manifold manifold_;
};

bool difference(const Geometry& a, const Geometry& b, const Data& data,
                const collision::Candidate& contact, double towards_b, ContactMotion& out) {
  MovingPair pair(a, b, data, contact);
  const double size = std::min(smallest_length(a.shape), smallest_length(b.shape));
  const Vector3 shift = towards_b * std::max(contact.gap, 0.0) * contact.normal;
  const Vector3 middle = contact.position - shift;
  const collision::ContactPoint* same = pair.find(pair.pose(), middle, kSame * size);
  if (same == nullptr || !(same->normal.dot(contact.normal) > 1.0 - kSame) ||
      !(std::abs(same->gap - contact.gap) < kSame * size)) {
    return false;
  }
  for (int column = 0; column < 6; ++column) {
    const double step = column < 3 ? kStep : kStep * size;
    collision::ContactPoint ends[2];
    for (const int side : {0, 1}) {
      const collision::ContactPoint* found =
          pair.find(pair.moved(column, side == 0 ? -step : step), middle, kFarthest * kStep * size);
      if (found == nullptr) return false;
      ends[side] = *found;
      ends[side].position += towards_b * std::max(found->gap, 0.0) * found->normal;
    }
    const double inverse = 0.5 / step;
    out.point.col(column) = (ends[1].position - ends[0].position) * inverse;
    out.normal.col(column) = (ends[1].normal - ends[0].normal) * inverse;
    out.gap[column] = (ends[1].gap - ends[0].gap) * inverse;
  }
  return true;
}

}  // namespace

bool find_contact_motion(const Model& model, const Data& data, const collision::Candidate& contact,
                         double towards_b, ContactMotion& out) {
  const Geometry& a = model.geometries()[contact.geometry_a];
  const Geometry& b = model.geometries()[contact.geometry_b];
  if (a.shape.type == ShapeType::kPlane &&
      touches_plane(b.shape, data.X_WB[b.body] * b.X_BG, contact, towards_b, -1.0, out))
    return true;
  if (b.shape.type == ShapeType::kPlane &&
      touches_plane(a.shape, data.X_WB[a.body] * a.X_BG, contact, towards_b, 1.0, out))
    return true;
  if (a.shape.type == ShapeType::kTerrain || b.shape.type == ShapeType::kTerrain) return false;
  return difference(a, b, data, contact, towards_b, out);
}

}  // namespace counterpoint
