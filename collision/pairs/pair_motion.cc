#include "counterpoint/collision/pairs/pair_motion.h"

#include <algorithm>
#include <limits>

#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

// Relative to the size: surfaces closer than this to one plane are flush; edges are rounded by as
// much.
constexpr double kFlush = 1e-6;
// Relative to the size: a shape that moves less than kStill in a step passes nothing, one that
// moves more than kFar may pass through another.
constexpr double kStill = 1e-9;
constexpr double kFar = 0.25;
// Cosine of 4e-5 rad: normals that agree better are equal.
constexpr double kSameNormal = 1.0 - 1e-9;

}  // namespace

Pose ShapeMotion::moved() const {
  const Matrix3 turn = quaternion_exp(displacement.angular).toRotationMatrix();
  return {turn * X_WG.rotation, origin + displacement.linear + turn * (X_WG.translation - origin)};
}

PairMotion::PairMotion(const ShapeMotion& motion_a, const ShapeMotion& motion_b,
                       const Vector3& middle, double radius)
    : a(motion_a),
      b(motion_b),
      size(radius),
      way((b.way_of(middle) - a.way_of(middle)).norm() +
          radius * (b.displacement.angular - a.displacement.angular).norm()) {}

double PairMotion::rounding() const { return std::max(0.0, kFlush * size - way); }

double PairMotion::closing(const Vector3& n, const Vector3& p) const {
  return n.dot(a.way_of(p) - b.way_of(p));
}

ContactPoint PairMotion::taken_back(const ContactPoint& after) const {
  const Vector3 way_a = a.way_of(after.position), way_b = b.way_of(after.position);
  // Along the normal, move to halfway between the surfaces; in the tangent plane, follow the body
  // that moves.
  const Vector3 mean = 0.5 * (way_a + way_b);
  const Vector3 carried = a.share * way_a + b.share * way_b;
  ContactPoint p = after;
  p.position -= carried + p.normal.dot(mean - carried) * p.normal;
  p.gap += closing(p.normal, p.position);
  return p;
}

bool stops(const PairMotion& motion, const Manifold& manifold) {
  if (!(motion.way > kStill * motion.size && motion.way < kFar * motion.size)) return false;
  return std::any_of(
      manifold.points.begin(), manifold.points.begin() + manifold.size,
      [&](const ContactPoint& p) { return p.gap < motion.closing(p.normal, p.position); });
}

void look_ahead(const Shape& a, const Shape& b, const PairMotion& motion, const PairQuery& query,
                Manifold& manifold) {
  if (!stops(motion, manifold)) return;
  double least = std::numeric_limits<double>::infinity();
  Vector3 normal = Vector3::UnitZ();
  for (int i = 0; i < manifold.size; ++i) {
    const ContactPoint& p = manifold.points[i];
    if (p.gap >= least) continue;
    least = p.gap;
    normal = p.normal;
  }
  Manifold ahead;
  pair_contacts(a, motion.a.moved(), b, motion.b.moved(), query, ahead);
  const double most_overlap = std::max(0.0, -least) + kFlush * motion.size;
  bool same = true;
  for (int i = 0; i < ahead.size; ++i) {
    ContactPoint& p = ahead.points[i];
    same = same && p.normal.dot(normal) > kSameNormal;
    p = motion.taken_back(p);
    if (p.gap < -most_overlap) return;
  }
  if (ahead.size > 0 && !same) manifold = ahead;
}

}  // namespace counterpoint::collision
