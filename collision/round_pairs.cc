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

namespace {

// Two numbers at a time.
using Two = double __attribute__((vector_size(16)));

// What two segments are like from scalar products alone: a first look, right to 1e-15 of their
// size, that spares most of the exact one.
class FirstLook {
 public:
  FirstLook(const Segment& a, const Segment& b)
      : half_a_(a.half_length), half_b_(b.half_length), cosine_(a.direction.dot(b.direction)) {
    const Vector3 r = b.center - a.center;
    r2_ = r.squaredNorm();
    ra_ = r.dot(a.direction);
    rb_ = r.dot(b.direction);
  }
  double cosine() const { return cosine_; }
  // Squared distances of the ends -1 and 1 of A, or of the ends of B on the same sides.
  Two ends_of_a() const { return end(Two{-half_a_, half_a_}, half_b_, ra_, rb_); }
  Two ends_of_b() const {
    const double half = cosine_ < 0.0 ? -half_b_ : half_b_;
    return end(Two{-half, half}, half_a_, -rb_, -ra_);
  }
  // False if the closest points of the lines are not between the ends, by more than `slack`.
  bool may_cross(double slack) const {
    const double sine2 = 1.0 - cosine_ * cosine_;
    return std::abs(ra_ - cosine_ * rb_) < half_a_ * sine2 + slack &&
           std::abs(cosine_ * ra_ - rb_) < half_b_ * sine2 + slack;
  }

 private:
  // Of the point s of one from the other of that half length.
  Two end(Two s, double half_length, double r_mine, double r_other) const {
    const Two foot = s * cosine_ - r_other;
    const Two low = {-half_length, -half_length};
    const Two above = foot < low ? low : foot;
    const Two t = -low < above ? -low : above;
    return r2_ + s * (s - 2.0 * r_mine) + t * (t - 2.0 * foot);
  }

  double half_a_, half_b_, cosine_, r2_, ra_, rb_;
};

}  // namespace

// Each end of the stretch where the two run side by side is an end of one of the segments; so the
// ends' own contacts are the manifold, and they move continuously. Where the segments cross, the
// closest point lies between and is added.
void capsule_capsule(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                     double margin, Manifold& out) {
  // Relative to the size and the margin: beyond it by more, or beyond an end, for sure.
  constexpr double kSurely = 1e-6;
  const Segment sa = capsule_segment(a, X_WA);
  const Segment sb = capsule_segment(b, X_WB);
  const double scale = a.size[0] + b.size[0] + sa.half_length + sb.half_length;
  const auto add = [&](const CorePair& pair) {
    // A direction is wanted only where the segments meet.
    const Vector3 fallback = pair.distance2 > 0.0 ? Vector3(Vector3::UnitZ()) : across(sa, sb);
    out.add_round(pair.a, a.size[0], pair.b, b.size[0], fallback, margin);
  };
  const FirstLook look(sa, sb);
  const double same_way = look.cosine() < 0.0 ? -1.0 : 1.0;
  const double slack = kSurely * (scale + std::abs(margin));
  const double reach = std::max(0.0, margin + a.size[0] + b.size[0]) + slack;
  const Two ends_a2 = look.ends_of_a();
  const Two ends_b2 = look.ends_of_b();

  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 2; ++i) {
    const double a2 = ends_a2[i];
    const double b2 = ends_b2[i];
    if (std::min(a2, b2) > reach * reach) continue;
    const double end = i == 0 ? -1.0 : 1.0;
    CorePair best;
    best.distance2 = std::numeric_limits<double>::infinity();
    if (!(a2 > b2 + slack * slack)) {
      const Vector3 end_a = sa.at(end * sa.half_length);
      best = core_pair(end_a, sb.at(sb.closest(end_a)));
    }
    if (!(b2 > a2 + slack * slack)) {
      const Vector3 end_b = sb.at(same_way * end * sb.half_length);
      const CorePair from_b = core_pair(sa.at(sa.closest(end_b)), end_b);
      if (from_b.distance2 < best.distance2) best = from_b;
    }
    least = std::min(least, best.distance2);
    add(best);
  }
  const double same2 = kSame * scale * (kSame * scale);
  if (out.size == 2 && (out.points[0].position - out.points[1].position).squaredNorm() < same2) {
    out.size = 1;
  }
  double s = 0.0;
  double t = 0.0;
  if (look.may_cross(slack) && closest_on_lines(sa, sb, s, t) && std::abs(s) < sa.half_length &&
      std::abs(t) < sb.half_length) {
    const CorePair crossing = core_pair(sa.at(s), sb.at(t));
    if (crossing.distance2 < least &&
        std::sqrt(crossing.distance2) < std::sqrt(least) - kSame * scale) {
      add(crossing);
    }
  }
}

}  // namespace counterpoint::collision
