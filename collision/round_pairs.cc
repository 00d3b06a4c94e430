// Spheres and capsules among one another: balls around points and segments.
#include <limits>

#include "counterpoint/collision/pair_functions.h"
#include "counterpoint/collision/segment.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint::collision {
namespace {

// Relative to the size of the shapes: points closer together are one, gaps closer are equal.
constexpr double kSame = 1e-10;

Segment capsule_segment(const Shape& shape, const Pose& X) {
  return {X.translation, X.rotation.col(2), shape.size[1]};
}

struct CorePair {
  Vector3 a, b;
  double distance2;
};

CorePair core_pair(const Vector3& a, const Vector3& b) { return {a, b, (b - a).squaredNorm()}; }

// A unit vector perpendicular to both segments.
Vector3 across(const Segment& a, const Segment& b) {
  const Vector3 cross = a.direction.cross(b.direction);
  const double sine = cross.norm();
  return sine > kSame ? Vector3(cross / sine) : Vector3(frame_from_normal(a.direction).col(0));
}

}  // namespace

void sphere_sphere(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   double margin, Manifold& out) {
  out.add_round(X_WA.translation, a.size[0], X_WB.translation, b.size[0], Vector3::UnitZ(), margin);
}

void sphere_capsule(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    double margin, Manifold& out) {
  const Segment segment = capsule_segment(b, X_WB);
  out.add_round(X_WA.translation, a.size[0], segment.at(segment.closest(X_WA.translation)),
                b.size[0], X_WB.rotation.col(0), margin);
}

// Each end of the stretch where the two run side by side is an end of one of the segments; so the
// ends' own contacts are the manifold, and they move continuously. Where the segments cross, the
// closest point lies between and is added.
void capsule_capsule(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                     double margin, Manifold& out) {
  const Segment sa = capsule_segment(a, X_WA);
  const Segment sb = capsule_segment(b, X_WB);
  const double scale = a.size[0] + b.size[0] + sa.half_length + sb.half_length;
  const auto add = [&](const CorePair& pair) {
    // A direction is wanted only where the segments meet.
    const Vector3 fallback = pair.distance2 > 0.0 ? Vector3(Vector3::UnitZ()) : across(sa, sb);
    out.add_round(pair.a, a.size[0], pair.b, b.size[0], fallback, margin);
  };
  const double same_way = sa.direction.dot(sb.direction) < 0.0 ? -1.0 : 1.0;

  double least = std::numeric_limits<double>::infinity();
  for (const double end : {-1.0, 1.0}) {
    const Vector3 end_a = sa.at(end * sa.half_length);
    const Vector3 end_b = sb.at(same_way * end * sb.half_length);
    const CorePair from_a = core_pair(end_a, sb.at(sb.closest(end_a)));
    const CorePair from_b = core_pair(sa.at(sa.closest(end_b)), end_b);
    const CorePair& best = from_b.distance2 < from_a.distance2 ? from_b : from_a;
    least = std::min(least, best.distance2);
    add(best);
  }
  const double same2 = kSame * scale * (kSame * scale);
  if (out.size == 2 && (out.points[0].position - out.points[1].position).squaredNorm() < same2) {
    out.size = 1;
  }
  double s = 0.0;
  double t = 0.0;
  if (closest_on_lines(sa, sb, s, t) && std::abs(s) < sa.half_length &&
      std::abs(t) < sb.half_length) {
    const CorePair crossing = core_pair(sa.at(s), sb.at(t));
    if (crossing.distance2 < least &&
        std::sqrt(crossing.distance2) < std::sqrt(least) - kSame * scale) {
      add(crossing);
    }
  }
}

}  // namespace counterpoint::collision
