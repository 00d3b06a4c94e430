#include "counterpoint/collision/convex/gjk.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "counterpoint/collision/convex/feature_pairs.h"
#include "counterpoint/collision/convex/minkowski.h"

namespace counterpoint::collision {
namespace {

// Relative to the size of the shapes: closer cores count as touching, since the direction between
// them would be round-off.
constexpr double kTouchingDistance = 1e-9;
// Error of the distance at which the iteration stops, relative to the size of the shapes and to the
// distance.
struct Accuracy {
  double of_size, of_distance;
};
constexpr Accuracy kFinal = {1e-13, 0.0};
// On a curved surface the iteration converges slowly; at these errors the touching pieces may be
// known and settle_on_feature_pair is tried.
constexpr Accuracy kCoarse[] = {{3e-3, 0.05}, {1e-5, 1e-3}};
constexpr int kMaxIterations = 200;  // then the last iterate is used
// The first steps overshoot: for kMaxAveraged steps the direction is averaged with the previous
// one, which saves one step in nine. Its support point w is used if v . w < kProgress |v|^2.
constexpr int kMaxAveraged = 2;
constexpr double kProgress = 0.999;
constexpr int kMaxStalls = 3;  // steps of one call that gain no more than round-off
constexpr double kNoFarther = 1.0 + 1e-15;

// The point of a simplex closest to the origin; indices of its vertices are ascending.
struct Closest {
  Vector3 point;
  double distance2 = std::numeric_limits<double>::infinity();
  std::array<int, 3> index;
  std::array<double, 3> weight;  // times weight_sum
  double weight_sum;
  int size = 0;

  void take_point(const Simplex& s, int i) {
    const Vector3& p = s.points[i].w;
    const double p2 = p.squaredNorm();
    if (p2 >= distance2) return;  // NaN is taken
    point = p;
    distance2 = p2;
    index[0] = i;
    weight[0] = 1.0;
    weight_sum = 1.0;
    size = 1;
  }
};

// The functions below update `c` if the part of the simplex that they test is closer.
void take_segment(const Simplex& s, int i, int j, Closest& c) {
  const Vector3& p = s.points[i].w;
  const Vector3 edge = s.points[j].w - p;
  const double length2 = edge.squaredNorm();
  const double along = -p.dot(edge);
  if (!(along > 0.0)) return c.take_point(s, i);
  if (along >= length2) return c.take_point(s, j);
  const double t = along / length2;
  const Vector3 point = p + t * edge;
  const double distance2 = point.squaredNorm();
  if (!(distance2 < c.distance2)) return;
  c.point = point;
  c.distance2 = distance2;
  c.index = {i, j, 0};
  c.weight = {1.0 - t, t, 0.0};
  c.weight_sum = 1.0;
  c.size = 2;
}

// If the foot of the origin on the triangle's plane lies outside the triangle, it lies beyond one
// or two edges, and the closest point is on one of these.
void take_triangle(const Simplex& s, int i, int j, int k, Closest& c) {
  const Vector3& p = s.points[i].w;
  const Vector3 e1 = s.points[j].w - p;
  const Vector3 e2 = s.points[k].w - p;
  const Vector3 normal = e1.cross(e2);
  const double area2 = normal.squaredNorm();
  const bool flat = !(area2 > 1e-28 * e1.squaredNorm() * e2.squaredNorm());
  const double wj = e2.cross(p).dot(normal);
  const double wk = p.cross(e1).dot(normal);
  const double wi = area2 - wj - wk;
  if (!flat && wi >= 0.0 && wj >= 0.0 && wk >= 0.0) {
    // Computed along the normal, not as a sum of corners, to keep digits if the plane passes close
    // by.
    const Vector3 point = normal * (normal.dot(p) / area2);
    const double distance2 = point.squaredNorm();
    if (!(distance2 < c.distance2)) return;
    c.point = point;
    c.distance2 = distance2;
    c.index = {i, j, k};
    c.weight = {wi, wj, wk};
    c.weight_sum = area2;
    c.size = 3;
    return;
  }
  if (flat || wk < 0.0) take_segment(s, i, j, c);
  if (flat || wi < 0.0) take_segment(s, j, k, c);
  if (flat || wj < 0.0) take_segment(s, i, k, c);
}

// The fourth point, added last, brings the origin closer than the triangle of the others. The
// three faces around it are tested if the origin is outside of them. If the origin is inside all
// four faces, `inside` is set.
void take_tetrahedron(const Simplex& s, Closest& best, bool& inside) {
  const Vector3& p = s.points[3].w;
  const Vector3 a = s.points[0].w - p;
  const Vector3 b = s.points[1].w - p;
  const Vector3 c = s.points[2].w - p;
  const Vector3 ab = a.cross(b);
  const double volume = ab.dot(c);
  // A flat tetrahedron contains nothing.
  const bool flat =
      !(volume * volume > 1e-28 * a.squaredNorm() * b.squaredNorm() * c.squaredNorm());
  const double sign = volume < 0.0 ? -1.0 : 1.0;
  // One bit per face avoids branches.
  constexpr int kEdges[3][2] = {{0, 1}, {1, 2}, {0, 2}};
  unsigned beyond = static_cast<unsigned>(sign * ab.dot(p) > 0.0) |
                    static_cast<unsigned>(sign * b.cross(c).dot(p) > 0.0) << 1 |
                    static_cast<unsigned>(sign * c.cross(a).dot(p) > 0.0) << 2;
  if (flat) beyond = 7;
  for (; beyond != 0; beyond &= beyond - 1) {
    const auto& edge = kEdges[std::countr_zero(beyond)];
    take_triangle(s, edge[0], edge[1], 3, best);
  }
  if (best.size > 0) return;
  const Vector3& q = s.points[0].w;
  inside = sign * (s.points[1].w - q).cross(s.points[2].w - q).dot(q) >= 0.0;
  if (!inside) take_triangle(s, 0, 1, 2, best);
}

// Returns whether the origin is inside; otherwise sets `c`.
bool closest_on_simplex(const Simplex& s, Closest& c) {
  bool inside = false;
  switch (s.size) {
    case 1:
      c.take_point(s, 0);
      break;
    case 2:
      take_segment(s, 0, 1, c);
      break;
    case 3:
      take_triangle(s, 0, 1, 2, c);
      break;
    default:
      take_tetrahedron(s, c, inside);
  }
  return inside;
}

void reduce(const Closest& c, Simplex& s) {
  for (int i = 0; i < c.size; ++i) {
    if (c.index[i] != i) s.points[i] = s.points[c.index[i]];
    s.weights[i] = c.weight[i];
  }
  s.weight_sum = c.weight_sum;
  s.size = c.size;
}

enum class Outcome { kSeparated, kTouching, kBeyondMargin };

// Moves v to the point of the difference closest to the origin, a combination of the simplex. On
// entry the simplex holds up to three points of the difference; if none, v is a guess of the
// direction, not zero.
Outcome iterate(const MinkowskiDifference& difference, double margin, const Accuracy& accuracy,
                Simplex& simplex, Vector3& v) {
  const double error = accuracy.of_size * difference.scale;
  const double touching = kTouchingDistance * difference.scale;
  double distance = std::numeric_limits<double>::infinity();
  if (simplex.size > 0) {
    Closest closest;
    closest_on_simplex(simplex, closest);
    reduce(closest, simplex);
    v = closest.point;
    distance = std::sqrt(closest.distance2);
    if (distance <= touching) return Outcome::kTouching;
  }
  // On curved surfaces averaging saves nothing.
  const bool average = simplex.size == 0 && !difference.curved();
  Vector3 previous;
  int stalls = 0;
  double norm = v.norm();
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const bool averaged = average && iteration > 0 && iteration <= kMaxAveraged;
    Vector3 direction = v;
    double length = norm;
    if (averaged) {
      direction = v / norm + previous;
      length = direction.norm();
    }
    if (iteration < kMaxAveraged) previous = direction / length;
    const DifferencePoint next = difference.support(-direction);
    const double lower_bound = direction.dot(next.w) / length;
    if (lower_bound >= margin) return Outcome::kBeyondMargin;
    if (distance - lower_bound <= error) break;
    if (simplex.size > 0 && distance - lower_bound <= accuracy.of_distance * distance) break;
    if (averaged && !(v.dot(next.w) < kProgress * distance * distance)) {
      iteration = kMaxAveraged;
      continue;
    }
    bool known = false;
    for (int i = 0; i < simplex.size; ++i) known = known || simplex.points[i].w == next.w;
    if (known) break;
    simplex.points[simplex.size++] = next;
    Closest closest;
    if (closest_on_simplex(simplex, closest)) return Outcome::kTouching;
    const double closer = std::sqrt(closest.distance2);
    // The distance reaches round-off long before the normal: it depends on the normal's error
    // squared.
    if (!(closer < distance) && (!(closer <= distance * kNoFarther) || ++stalls > kMaxStalls)) {
      --simplex.size;
      break;
    }
    reduce(closest, simplex);
    distance = norm = closer;
    v = closest.point;
    if (distance <= touching) return Outcome::kTouching;
  }
  return Outcome::kSeparated;
}

void fill_witness(const Simplex& simplex, const Vector3& v, Witness& out) {
  out.point_a.setZero();
  out.point_b.setZero();
  for (int i = 0; i < simplex.size; ++i) {
    const double weight = simplex.weights[i] / simplex.weight_sum;
    out.point_a += weight * simplex.points[i].a;
    out.point_b += weight * simplex.points[i].b;
  }
  out.distance = v.norm();
  out.normal = v / out.distance;
}

// Finds the least translation that separates overlapping cores, from an initial normal. B is moved
// along the normal until the cores are slightly apart; the direction between their closest points
// is the next normal. Exact after one round for polytopes. For a radius of curvature r each round
// multiplies the error of the normal by (depth + apart) / (r + apart); therefore `apart` does not
// exceed the depth.
void refine_depth(const MinkowskiDifference& overlapping, const Vector3& first, Witness& out) {
  constexpr int kMaxRounds = 20;  // polytopes need one, curved shapes more
  constexpr int kCoarseRounds = 1;
  constexpr Accuracy kFirst = {1e-7, 0.0};
  constexpr double kLeastApart =
      1e-4;  // relative to the size; less would cost digits of the normal
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
    const Accuracy& accuracy = round < kCoarseRounds ? kFirst : kFinal;
    if (iterate(difference, infinity, accuracy, simplex, v) != Outcome::kSeparated) return;
    Witness next{Vector3::Zero(), Vector3::Zero(), normal, distance};
    fill_witness(simplex, v, next);
    next.point_b -= difference.shift;
    next.distance = overlapping.distance_along(next.normal);
    const double gain = next.distance - distance;
    if (round > kCoarseRounds && gain < 0.0) return;
    out = next;
    if (round >= kCoarseRounds && gain <= kFinal.of_size * scale) return;
    normal = next.normal;
    distance = next.distance;
  }
}

// Finds the closest points, or for overlapping cores the points of least penetration. False if the
// cores are at least `margin` [m] apart along out.normal.
bool solve(const MinkowskiDifference& difference, double margin, Witness& out) {
  const bool curved = difference.curved();
  Simplex simplex;
  Vector3 v = difference.b.center() - difference.a.center();
  if (v.squaredNorm() == 0.0) v = Vector3::UnitX();
  Outcome outcome = Outcome::kSeparated;
  for (int stage = curved ? 0 : 2; stage < 3 && outcome == Outcome::kSeparated; ++stage) {
    outcome = iterate(difference, margin, stage < 2 ? kCoarse[stage] : kFinal, simplex, v);
    if (stage < 2 && outcome == Outcome::kSeparated &&
        settle_on_feature_pair(difference, simplex.points.data(), simplex.size, v.normalized(),
                               kTouchingDistance * difference.scale, out)) {
      return true;
    }
  }
  switch (outcome) {
    case Outcome::kBeyondMargin:
      out.normal = v.normalized();
      out.distance = margin;
      return false;
    case Outcome::kSeparated:
      fill_witness(simplex, v, out);
      break;
    case Outcome::kTouching:
      if (!expand_polytope(difference, simplex, out))
        refine_depth(difference, Vector3(out.normal), out);
      break;
  }
  return true;
}

// Returns whether the distance along the normal stays the same when every vertex is tested. Hill
// climbing finds the farthest vertex of a convex mesh; a mesh with merged faces is only nearly
// convex, and on a thin one the climb may stop far from it.
bool confirm(const MinkowskiDifference& difference, const Witness& witness) {
  constexpr double kNormalError = 1e-7;  // relative to the size: effect of the normal's own error
  const Vector3& n = witness.normal;
  const double distance = -difference.b.scan_support(-n) - difference.a.scan_support(n);
  return distance >= witness.distance - kNormalError * difference.scale;
}

}  // namespace

bool closest_points(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    double margin, Witness& out) {
  CoreShape core_a(a, X_WA);
  CoreShape core_b(b, X_WB);
  const Vector3 apart = core_b.center() - core_a.center();
  if (core_a.climbs()) core_a.hint = likely_vertex(*a.mesh, X_WA.rotation.transpose() * apart);
  if (core_b.climbs()) core_b.hint = likely_vertex(*b.mesh, X_WB.rotation.transpose() * -apart);
  const double radius = core_a.radius + core_b.radius;
  const MinkowskiDifference difference{core_a, core_b, core_a.extent() + core_b.extent() + radius,
                                       Vector3::Zero()};
  const bool within = solve(difference, margin + radius, out);
  if ((core_a.climbs() || core_b.climbs()) && !confirm(difference, out)) {
    core_a.scan = core_b.scan = true;
    if (!solve(difference, margin + radius, out)) return false;
  } else if (!within) {
    return false;
  }
  out.vertex_a = core_a.hint;
  out.vertex_b = core_b.hint;
  return out.distance - radius < margin;
}

}  // namespace counterpoint::collision
