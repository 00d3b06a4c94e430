#include "counterpoint/engine/derivatives/contact_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/corner_contacts.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint {
namespace {

/// Relative to the shapes' size: what lies closer together is one.
constexpr double kSame = 1e-9;
/// The difference step [m], relative to the gap, which is the radius that normals of corners turn
/// about; at most this share of the smallest length of the two shapes, at least so much. As an
/// angle over that length.
constexpr double kGapShare = 1e-4, kSizeShare = 1e-5, kLeastStep = 1e-8;
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
    return (p - center - along * axis).norm() < kSame * size &&
           std::abs(along) < half + kSame * size;
  }
  /// The point is the one closest to what lies along n, and slides along the segment; else it is an
  /// end, or held otherwise.
  bool slides(const Vector3& p, const Vector3& n) const {
    return std::abs(axis.dot(p - center)) < half - kSame * (half + radius) &&
           std::abs(axis.dot(n)) < 1e-7;
  }
};

bool is_round(const Shape& shape) {
  return shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule;
}

/// Of two balls about points c_A, c_B of segments, that slide as long as c_B - c_A is across them.
bool rounds_touch(const Round& a, const Round& b, const collision::Candidate& contact,
                  const Vector3& middle, double towards_b, ContactMotion& out) {
  const Vector3& n = contact.normal;
  const double distance = contact.gap + a.radius + b.radius;
  const double to_a = a.radius + 0.5 * contact.gap;
  const Vector3 at_a = middle - to_a * n, at_b = middle + (b.radius + 0.5 * contact.gap) * n;
  if (!(distance > kSame * (a.radius + b.radius)) || !a.holds(at_a) || !b.holds(at_b)) return false;
  using Row6 = Eigen::Matrix<double, 1, 6>;
  Eigen::Matrix<double, 3, 6> apart;  // of c_B - c_A
  apart << -skew(at_b - contact.position), Matrix3::Identity();
  out.gap = n.transpose() * apart;
  Row6 s = Row6::Zero(), t = Row6::Zero();  // along the segments
  const bool a_slides = a.slides(at_a, n), b_slides = b.slides(at_b, n);
  if (a_slides) s = a.axis.transpose() * apart;
  if (b_slides) {
    t = -b.axis.transpose() * apart;
    t.head<3>() -= distance * b.axis.cross(n).transpose();
  }
  if (a_slides && b_slides) {
    const double cosine = a.axis.dot(b.axis), sine2 = 1.0 - cosine * cosine;
    if (!(sine2 > kSame)) return false;
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

/// `index` where the manifold is like the one that this counts in, else the closest; null if that
/// is too far off.
const collision::ContactPoint* like(const collision::Manifold& here, int index,
                                    const collision::Manifold& manifold, const Vector3& expected,
                                    double most) {
  if (manifold.size == here.size &&
      (manifold.points[index].position - expected).squaredNorm() < most * most)
    return &manifold.points[index];
  const collision::ContactPoint* best = nullptr;
  double least = most * most;
  for (int i = 0; i < manifold.size; ++i) {
    const double distance = (manifold.points[i].position - expected).squaredNorm();
    if (distance > least) continue;
    least = distance;
    best = &manifold.points[i];
  }
  return best;
}

/// A small twist (column 0 ... 5) about a point.
Pose turned_about(const Vector3& at, const Pose& X, int column, double by) {
  if (column >= 3) return {X.rotation, X.translation + by * Vector3::Unit(column - 3)};
  const Matrix3 turn = quaternion_exp(by * Vector3::Unit(column)).toRotationMatrix();
  return {turn * X.rotation, at + turn * (X.translation - at)};
}

}  // namespace

/// Its index among the contacts of the pair's pose; -1 if it is not among them.
int ContactMotionFinder::index_here(const Pair& pair, const collision::Candidate& contact,
                                    const Vector3& middle) const {
  const double near = kSame * pair.size;
  int best = -1;
  double least = 3.0 * near;
  for (int i = 0; i < here_.size; ++i) {
    const collision::ContactPoint& p = here_.points[i];
    if (!(p.normal.dot(contact.normal) > 1.0 - kSame)) continue;
    // Of contacts in one place the one of the same gap.
    const double off = (p.position - middle).norm() + std::abs(p.gap - contact.gap);
    if (off >= least) continue;
    least = off;
    best = i;
  }
  return best;
}

/// The contacts of the pair, and with B in neighbouring poses.
void ContactMotionFinder::move_pair(const Pair& pair, const collision::Candidate& contact) {
  // Some more room, so that a contact does not vanish at the margin.
  const collision::PairQuery query(std::abs(contact.gap) + pair.size);
  about_ = contact.position;
  step_ = std::clamp(kGapShare * std::abs(contact.gap), kLeastStep, kSizeShare * pair.size);
  for (int column = 0; column < 6; ++column) {
    const double step = column < 3 ? step_ / pair.size : step_;
    for (const int side : {0, 1})
      collision::pair_contacts(*pair.a, pair.X_WA, *pair.b,
                               turned_about(about_, pair.X_WB, column, side == 0 ? -step : step),
                               query, moved_[column][side]);
  }
}

bool ContactMotionFinder::difference(const Pair& pair, const collision::Candidate& contact,
                                     int index, double towards_b, ContactMotion& out) {
  const Vector3 middle = contact.position - towards_b * std::max(contact.gap, 0.0) * contact.normal;
  for (int column = 0; column < 6; ++column) {
    const double step = column < 3 ? step_ / pair.size : step_;
    collision::ContactPoint ends[2];
    for (const int side : {0, 1}) {
      const collision::ContactPoint* found =
          like(here_, index, moved_[column][side], middle, kFarthest * step_);
      if (found == nullptr) return false;
      ends[side] = *found;
      ends[side].position += towards_b * std::max(found->gap, 0.0) * found->normal;
    }
    const double inverse = 0.5 / step;
    out.point.col(column) = (ends[1].position - ends[0].position) * inverse;
    out.normal.col(column) = (ends[1].normal - ends[0].normal) * inverse;
    out.gap[column] = (ends[1].gap - ends[0].gap) * inverse;
  }
  // From turns about about_ to turns about the contact.
  const Matrix3 arm = skew(contact.position - about_);
  out.point.leftCols<3>() += out.point.rightCols<3>() * arm;
  out.normal.leftCols<3>() += out.normal.rightCols<3>() * arm;
  out.gap.head<3>() += out.gap.tail<3>() * arm;
  return true;
}

/// Of corners taken as points and of balls inside shapes (corner_contacts.h).
bool ContactMotionFinder::difference_balls(const Pair& pair, const collision::Candidate& contact,
                                           double towards_b, ContactMotion& out) {
  geometry_a_ = geometry_b_ = -1;
  const Vector3 middle = contact.position - towards_b * std::max(contact.gap, 0.0) * contact.normal;
  const collision::PairQuery query(std::abs(contact.gap) + pair.size);
  for (const bool of_a : {true, false}) {
    const collision::StandIns balls =
        collision::stand_ins(of_a ? *pair.a : *pair.b, of_a ? pair.X_WA : pair.X_WB);
    for (int i = 0; i < balls.size; ++i) {
      Pair with_ball = pair;
      (of_a ? with_ball.a : with_ball.b) = &balls.balls[i].shape;
      (of_a ? with_ball.X_WA : with_ball.X_WB) = balls.balls[i].X;
      collision::pair_contacts(*with_ball.a, with_ball.X_WA, *with_ball.b, with_ball.X_WB, query,
                               here_);
      const int index = index_here(with_ball, contact, middle);
      if (index < 0) continue;
      move_pair(with_ball, contact);
      return difference(with_ball, contact, index, towards_b, out);
    }
  }
  return false;
}

bool ContactMotionFinder::find(const Model& model, const Data& data,
                               const collision::Candidate& contact, double towards_b,
                               ContactMotion& out) {
  const Geometry& a = model.geometries()[contact.geometry_a];
  const Geometry& b = model.geometries()[contact.geometry_b];
  Pair pair{&a.shape, &b.shape, data.X_WB[a.body] * a.X_BG, data.X_WB[b.body] * b.X_BG,
            std::min(smallest_length(a.shape), smallest_length(b.shape))};
  if (a.shape.type == ShapeType::kPlane &&
      touches_plane(b.shape, pair.X_WB, contact, towards_b, -1.0, out))
    return true;
  if (b.shape.type == ShapeType::kPlane &&
      touches_plane(a.shape, pair.X_WA, contact, towards_b, 1.0, out))
    return true;
  const Vector3 middle = contact.position - towards_b * std::max(contact.gap, 0.0) * contact.normal;
  if (is_round(a.shape) && is_round(b.shape) &&
      rounds_touch(Round(a.shape, pair.X_WA), Round(b.shape, pair.X_WB), contact, middle, towards_b,
                   out))
    return true;
  if (a.shape.type == ShapeType::kTerrain || b.shape.type == ShapeType::kTerrain) return false;
  const bool known = contact.geometry_a == geometry_a_ && contact.geometry_b == geometry_b_;
  int index = known ? index_here(pair, contact, middle) : -1;
  if (index < 0) {
    const collision::PairQuery query(std::abs(contact.gap) + pair.size);
    collision::pair_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, query, here_);
    index = index_here(pair, contact, middle);
    if (index < 0) return difference_balls(pair, contact, towards_b, out);
    move_pair(pair, contact);
    geometry_a_ = contact.geometry_a;
    geometry_b_ = contact.geometry_b;
  }
  return difference(pair, contact, index, towards_b, out);
}

}  // namespace counterpoint
