#include "counterpoint/collision/gjk.h"

#include <algorithm>
#include <limits>

#include "counterpoint/collision/minkowski.h"

namespace counterpoint::collision {
namespace {

// Relative to the size of the shapes: cores closer than this are taken to touch; the direction between
// them would be round-off.
constexpr double kTouchingDistance = 1e-9;
// Relative to the size of the shapes: error of the distance at which the iteration stops.
constexpr double kDistanceError = 1e-13;
constexpr int kMaxIterations = 200;

// The part of a simplex closest to the origin.
struct Closest {
  Vector3 point;
  double distance2 = std::numeric_limits<double>::infinity();
  std::array<int, 3> index{};
  std::array<double, 3> weight{};
  int size = 0;

  void take_if_closer(const Closest& other) {
    if (other.distance2 < distance2) *this = other;
  }
};

Closest closest_on_segment(const Simplex& s, int i, int j) {
  const Vector3& p = s.points[i].w;
  const Vector3 edge = s.points[j].w - p;
  const double length2 = edge.squaredNorm();
  const double t = length2 > 0.0 ? -p.dot(edge) / length2 : 0.0;
  Closest c;
  if (t <= 0.0) {
    c = {p, p.squaredNorm(), {i, 0, 0}, {1.0, 0.0, 0.0}, 1};
  } else if (t >= 1.0) {
    const Vector3& q = s.points[j].w;
    c = {q, q.squaredNorm(), {j, 0, 0}, {1.0, 0.0, 0.0}, 1};
  } else {
    c.point = p + t * edge;
    c.distance2 = c.point.squaredNorm();
    c.index = {i, j, 0};
    c.weight = {1.0 - t, t, 0.0};
    c.size = 2;
  }
  return c;
}

Closest closest_on_triangle(const Simplex& s, int i, int j, int k) {
  const Vector3& p = s.points[i].w;
  const Vector3 e1 = s.points[j].w - p;
  const Vector3 e2 = s.points[k].w - p;
  const Vector3 normal = e1.cross(e2);
  const double area2 = normal.squaredNorm();
  Closest c;
  if (area2 > 1e-28 * e1.squaredNorm() * e2.squaredNorm()) {
    const double wj = e2.cross(p).dot(normal) / area2;
    const double wk = p.cross(e1).dot(normal) / area2;
    if (wj >= 0.0 && wk >= 0.0 && wj + wk <= 1.0) {
      // Along the normal, not as a sum of corners: no digits are lost when the plane passes close by.
      c.point = normal * (normal.dot(p) / area2);
      c.distance2 = c.point.squaredNorm();
      c.index = {i, j, k};
      c.weight = {1.0 - wj - wk, wj, wk};
      c.size = 3;
      return c;
    }
  }
  c.take_if_closer(closest_on_segment(s, i, j));
  c.take_if_closer(closest_on_segment(s, j, k));
  c.take_if_closer(closest_on_segment(s, k, i));
  return c;
}

// Is the origin in the tetrahedron? Flat ones hold nothing.
bool contains_origin(const Simplex& s) {
  const Vector3& p = s.points[3].w;
  const Vector3 a = s.points[0].w - p;
  const Vector3 b = s.points[1].w - p;
  const Vector3 c = s.points[2].w - p;
  const double volume = a.cross(b).dot(c);
  if (std::abs(volume) <= 1e-14 * a.norm() * b.norm() * c.norm()) return false;
  const double wa = p.cross(b).dot(c) / -volume;
  const double wb = a.cross(p).dot(c) / -volume;
  const double wc = a.cross(b).dot(p) / -volume;
  return wa >= 0.0 && wb >= 0.0 && wc >= 0.0 && wa + wb + wc <= 1.0;
}

Closest closest_on_simplex(const Simplex& s) {
  switch (s.size) {
    case 1: return {s.points[0].w, s.points[0].w.squaredNorm(), {0, 0, 0}, {1.0, 0.0, 0.0}, 1};
    case 2: return closest_on_segment(s, 0, 1);
    case 3: return closest_on_triangle(s, 0, 1, 2);
    default: break;
  }
  // Not 0, 1, 2: that was the simplex before, and the point added last brings it closer.
  Closest c = closest_on_triangle(s, 0, 1, 3);
  c.take_if_closer(closest_on_triangle(s, 1, 2, 3));
  c.take_if_closer(closest_on_triangle(s, 2, 0, 3));
  return c;
}

void reduce(const Closest& c, Simplex& s) {
  std::array<DifferencePoint, 3> kept;
  for (int i = 0; i < c.size; ++i) kept[i] = s.points[c.index[i]];
  for (int i = 0; i < c.size; ++i) {
    s.points[i] = kept[i];
    s.weights[i] = c.weight[i];
  }
  s.size = c.size;
}

enum class Outcome { kSeparated, kTouching, kBeyondMargin };

// v becomes the point of the difference closest to the origin, a combination of the simplex.
// On entry the simplex holds up to three points of the difference, maybe none; then v is a guess of the
// direction, not zero.
Outcome iterate(const MinkowskiDifference& difference, double margin, double error,
                Simplex& simplex, Vector3& v) {
  const double touching = kTouchingDistance * difference.scale;
  double distance = std::numeric_limits<double>::infinity();
  if (simplex.size > 0) {
    const Closest closest = closest_on_simplex(simplex);
    reduce(closest, simplex);
    v = closest.point;
    distance = v.norm();
    if (distance <= touching) return Outcome::kTouching;
  }
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const DifferencePoint next = difference.support(-v);
    const double norm = v.norm();
    const double lower_bound = v.dot(next.w) / norm;
    if (lower_bound >= margin) return Outcome::kBeyondMargin;
    if (distance - lower_bound <= error * difference.scale) break;
    bool known = false;
    for (int i = 0; i < simplex.size; ++i) known = known || simplex.points[i].w == next.w;
    if (known) break;
    simplex.points[simplex.size++] = next;
    if (simplex.size == 4 && contains_origin(simplex)) return Outcome::kTouching;
    const Closest closest = closest_on_simplex(simplex);
    const double closer = std::sqrt(closest.distance2);
    if (!(closer < distance)) {  // round-off: no progress is left
      --simplex.size;
      break;
    }
    reduce(closest, simplex);
    distance = closer;
    v = closest.point;
    if (distance <= touching) return Outcome::kTouching;
  }
  return Outcome::kSeparated;
}

void fill_witness(const Simplex& simplex, const Vector3& v, Witness& out) {
  out.point_a.setZero();
  out.point_b.setZero();
  for (int i = 0; i < simplex.size; ++i) {
    out.point_a += simplex.weights[i] * simplex.points[i].a;
    out.point_b += simplex.weights[i] * simplex.points[i].b;
  }
  out.distance = v.norm();
  out.normal = v / out.distance;
}

// Least translation that parts overlapping cores, from a first normal. B is moved along the normal until
// the cores are a little apart; the direction of their closest points is the next normal. Exact after one
// round for polytopes; over a radius of curvature r the error of the normal shrinks by (depth + apart) /
// (r + apart) a round, so they are moved no farther apart than they overlap.
void refine_depth(const MinkowskiDifference& overlapping, const Vector3& first, Witness& out) {
  constexpr int kMaxRounds = 20;
  constexpr int kCoarseRounds = 1;
  constexpr double kCoarseError = 1e-7;
  constexpr double kLeastApart = 1e-4;  // relative to the size; less would cost digits of the normal
  constexpr double kMostApart = 0.05;
  const double scale = overlapping.scale;
  const double infinity = std::numeric_limits<double>::infinity();
  Vector3 normal = first;
  double distance = overlapping.distance_along(normal);
  out = {Vector3::Zero(), Vector3::Zero(), normal, distance};
  MinkowskiDifference difference = overlapping;
  Simplex simplex;
  Vector3 v;
  for (int round = 0; round < kMaxRounds; ++round) {
    const double apart = std::clamp(-distance, kLeastApart * scale, kMostApart * scale);
    const Vector3 shift = (apart - distance) * normal;
    for (int i = 0; i < simplex.size; ++i) {
      simplex.points[i].b += shift - difference.shift;
      simplex.points[i].w = simplex.points[i].b - simplex.points[i].a;
    }
    difference.shift = shift;
    v = apart * normal;
    const double error = round < kCoarseRounds ? kCoarseError : kDistanceError;
    if (iterate(difference, infinity, error, simplex, v) != Outcome::kSeparated) return;
    Witness next;
    fill_witness(simplex, v, next);
    next.point_b -= difference.shift;
    next.distance = overlapping.distance_along(next.normal);
    const double gain = next.distance - distance;
    if (round > kCoarseRounds && gain < 0.0) return;
    out = next;
    if (round >= kCoarseRounds && gain <= kDistanceError * scale) return;
    normal = next.normal;
    distance = next.distance;
  }
}

}  // namespace

bool closest_points(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    double margin, Witness& out) {
  const CoreShape core_a(a, X_WA);
  const CoreShape core_b(b, X_WB);
  const double radius = core_a.radius + core_b.radius;
  const MinkowskiDifference difference{core_a, core_b, core_a.extent() + core_b.extent() + radius,
                                       Vector3::Zero()};
  Simplex simplex;
  Vector3 v;
  v = core_b.center() - core_a.center();
  if (v.squaredNorm() == 0.0) v = Vector3::UnitX();
  switch (iterate(difference, margin + radius, kDistanceError, simplex, v)) {
    case Outcome::kBeyondMargin: return false;
    case Outcome::kTouching:
      refine_depth(difference, expand_polytope(difference, simplex), out);
      break;
    case Outcome::kSeparated: fill_witness(simplex, v, out); break;
  }
  return out.distance - radius < margin;
}

}  // namespace counterpoint::collision
