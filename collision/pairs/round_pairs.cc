// Spheres and capsules among each other: balls around points and segments.
#include <limits>

#include "counterpoint/collision/pairs/pair_functions.h"
#include "counterpoint/collision/shapes/segment.h"
#include "counterpoint/contact/lanes/wide.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

// Relative to the size of the shapes: closer points are one point, closer gaps are equal.
constexpr double kEqual = 1e-10;

// Returns a unit vector perpendicular to the unit vectors u and v.
[[gnu::noinline]] Vector3 across(const Vector3& u, const Vector3& v) {
  const Vector3 cross = u.cross(v);
  const double sine = cross.norm();
  return sine > kEqual ? Vector3(cross / sine) : Vector3(frame_from_normal(u).col(0));
}

}  // namespace

void sphere_sphere(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  out.add_round(Vector3::Zero(), a.size[0], X_WB.translation - X_WA.translation, b.size[0],
                Vector3::UnitZ(), margin);
  if (out.size > 0) out.points[0].position += X_WA.translation;
}

void sphere_capsule(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Segment segment{X_WB.translation - X_WA.translation, X_WB.rotation.col(2), b.size[1]};
  out.add_round(Vector3::Zero(), a.size[0], segment.at(segment.closest(Vector3::Zero())), b.size[0],
                X_WB.rotation.col(0), margin);
  if (out.size > 0) out.points[0].position += X_WA.translation;
}

namespace {

using Two = double __attribute__((vector_size(16)));

// The segments s u, |s| <= half_u, and r + t v, |t| <= half_v; u and v have unit length.
struct Segments {
  Vector3 r, u, v;
  double half_u, half_v;

  Vector3 between(double s, double t) const { return (r + t * v) - s * u; }
};

// Finds the parameters where the lines of nearly parallel segments come closest; false if that is
// beyond an end. Scalar products have too few digits there.
[[gnu::noinline]] bool cross_at_grazing(const Segments& g, double& s, double& t) {
  return closest_on_lines({Vector3::Zero(), g.u, g.half_u}, {g.r, g.v, g.half_v}, s, t) &&
         std::abs(s) < g.half_u && std::abs(t) < g.half_v;
}

// Compares two distances exactly, where scalar products cannot tell.
[[gnu::noinline]] bool is_closer(const Segments& g, double s, double t, double s_other,
                                 double t_other) {
  return g.between(s, t).squaredNorm() < g.between(s_other, t_other).squaredNorm();
}

}  // namespace

// Each end of the stretch where the two run side by side is an end of one of the segments. The
// contacts of these ends are the manifold; they move continuously. If the segments cross, the
// closest point lies between them and is added. Scalar products, accurate to 1e-15 of the size,
// choose the points; the positions are then computed exactly. Long: all parts work on the same
// dozen values.
COUNTERPOINT_WIDE void capsule_capsule(const Shape& a, const Pose& X_WA, const Shape& b,
                                       const Pose& X_WB, const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  // Relative to size and margin: a difference that round-off cannot explain.
  constexpr double kSurely = 1e-6;
  // Squared sine below which the lines count as nearly parallel.
  constexpr double kGrazing = 1e-4;
  const Segments segments{X_WB.translation - X_WA.translation, X_WA.rotation.col(2),
                          X_WB.rotation.col(2), a.size[1], b.size[1]};
  // Not a structured binding: in Clang 14 a lambda cannot capture one.
  const Vector3 &r = segments.r, &u = segments.u, &v = segments.v;
  const double half_u = segments.half_u, half_v = segments.half_v;
  const double radius = a.size[0] + b.size[0];
  const double scale = radius + half_u + half_v;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double least = infinity;
  // Adds the contact at (s, t) if its gap is below the margin and the segments' distance below
  // `most`.
  const auto add = [&](double s, double t, double most) __attribute__((always_inline)) {
    const Vector3 d = segments.between(s, t);
    const double distance = d.norm();
    const double gap = distance - radius;
    if (!(gap < margin && distance < most)) return;
    least = std::min(least, distance);
    const Vector3 normal = distance > 0.0 ? Vector3(d * (1.0 / distance)) : across(u, v);
    ContactPoint& point = out.points[out.size++];
    point.position =
        X_WA.translation + (s * u + (0.5 * d + (0.5 * (a.size[0] - b.size[0])) * normal));
    point.normal = normal;
    point.gap = gap;
  };
  const double cosine = u.dot(v);
  const double ru = r.dot(u);
  const double rv = r.dot(v);
  const double r2 = r.squaredNorm();
  // Ends of A, and the ends of B on the same sides, with the closest points on the other segment.
  const Two end_s = {-half_u, half_u};
  const double same_way = std::copysign(half_v, cosine);
  const Two end_t = {-same_way, same_way};
  const Two most_s = Two{} + half_u;
  const Two most_t = Two{} + half_v;
  const Two free_t = end_s * cosine - rv;
  const Two free_s = end_t * cosine + ru;
  Two foot_t = free_t < -most_t ? -most_t : free_t;
  foot_t = most_t < foot_t ? most_t : foot_t;
  Two foot_s = free_s < -most_s ? -most_s : free_s;
  foot_s = most_s < foot_s ? most_s : foot_s;
  const Two of_a2 = end_s * (end_s - 2.0 * ru) + foot_t * (foot_t - 2.0 * free_t);
  const Two of_b2 = end_t * (end_t + 2.0 * rv) + foot_s * (foot_s - 2.0 * free_s);
  const Two closer2 = (of_b2 < of_a2 ? of_b2 : of_a2) + r2;
  const double slack = kSurely * (scale + std::abs(margin));
  const double reach = std::max(0.0, margin + radius) + slack;
  for (int i = 0; i < 2; ++i) {
    if (!(closer2[i] <= reach * reach)) continue;
    bool b_ends = of_b2[i] < of_a2[i];
    if (std::abs(of_b2[i] - of_a2[i]) < slack * slack) [[unlikely]] {
      b_ends = is_closer(segments, foot_s[i], end_t[i], end_s[i], foot_t[i]);
    }
    add(b_ends ? foot_s[i] : end_s[i], b_ends ? end_t[i] : foot_t[i], infinity);
  }
  const double same = kEqual * scale;
  if (out.size == 2 &&
      (out.points[0].position - out.points[1].position).squaredNorm() < same * same) {
    out.size = 1;
  }
  const double sine2 = 1.0 - cosine * cosine;
  double s = ru - cosine * rv;
  double t = cosine * ru - rv;
  if (sine2 < kGrazing) [[unlikely]] {
    if (!cross_at_grazing(segments, s, t)) return;
  } else {
    if (!(std::abs(s) < half_u * sine2 && std::abs(t) < half_v * sine2)) return;
    const double inverse = 1.0 / sine2;
    s *= inverse;
    t *= inverse;
  }
  add(s, t, least - same);
}

}  // namespace counterpoint::collision
