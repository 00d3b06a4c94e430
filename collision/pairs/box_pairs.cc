// Boxes against spheres and capsules: closest points in the frame of the box.
#include <array>
#include <limits>

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/pairs/pair_functions.h"
#include "counterpoint/collision/shapes/segment.h"

namespace counterpoint::collision {
namespace {

// Relative to the size of the shapes: closer gaps are equal.
constexpr double kSameGap = 1e-10;

Vector3 clamp_to(const Vector3& p, const Vector3& half) { return p.cwiseMin(half).cwiseMax(-half); }

// Returns the parameter of the segment's point closest to the box (the lowest such). The derivative
// of half the squared distance is continuous, nondecreasing, and linear between the points where a
// coordinate enters or leaves the box, so its root is found exactly.
double closest_parameter(const Segment& segment, const Vector3& half) {
  const Vector3& c = segment.center;
  const Vector3& d = segment.direction;
  const auto slope = [&](double t) {
    const Vector3 p = c + t * d;
    return d.dot(p - clamp_to(p, half));
  };
  double low = -segment.half_length;
  double slope_low = slope(low);
  if (slope_low >= 0.0) return low;
  std::array<double, 7> breaks;
  int size = 0;
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0.0) continue;
    for (const double side : {-half[i], half[i]}) {
      const double t = (side - c[i]) / d[i];
      if (!(std::abs(t) < segment.half_length)) continue;
      int k = size++;
      for (; k > 0 && breaks[k - 1] > t; --k) breaks[k] = breaks[k - 1];
      breaks[k] = t;
    }
  }
  breaks[size++] = segment.half_length;
  for (int k = 0; k < size; ++k) {
    const double high = breaks[k];
    const double slope_high = slope(high);
    if (slope_high >= 0.0) return low + (high - low) * (-slope_low / (slope_high - slope_low));
    low = high;
    slope_low = slope_high;
  }
  return segment.half_length;
}

// Finds the least translation that separates a segment from a box that it intersects, in the frame
// of the box. The faces of their Minkowski difference are those of the box and those spanned by an
// edge and the segment. Returns the normal from box to segment, the distance (negative) and the
// touching points.
Witness segment_in_box(const Segment& segment, const Vector3& half) {
  const Vector3& c = segment.center;
  const Vector3& d = segment.direction;
  const double scale = half.sum() + segment.half_length;
  Witness witness;
  witness.distance = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double distance = std::abs(c[i]) - half[i] - segment.half_length * std::abs(d[i]);
    if (distance <= witness.distance) continue;
    const double sign = c[i] < 0.0 ? -1.0 : 1.0;
    witness.normal = sign * Vector3::Unit(i);
    witness.distance = distance;
    witness.point_b = segment.at(sign * d[i] > 0.0 ? -segment.half_length : segment.half_length);
    witness.point_a = witness.point_b - distance * witness.normal;
  }
  for (int i = 0; i < 3; ++i) {
    Vector3 normal = Vector3::Unit(i).cross(d);
    const double sine = normal.norm();
    if (sine < 1e-7) continue;
    normal /= sine;
    if (normal.dot(c) < 0.0) normal = -normal;
    const double distance = normal.dot(c) - normal.cwiseAbs().dot(half);
    // Faces are preferred, so that round-off does not choose if segment and face are parallel.
    if (distance <= witness.distance + kSameGap * scale) continue;
    Vector3 edge;
    for (int k = 0; k < 3; ++k) edge[k] = normal[k] < 0.0 ? -half[k] : half[k];
    edge[i] = 0.0;
    double s = 0.0;
    double t = 0.0;
    if (!closest_on_lines({edge, Vector3::Unit(i), half[i]}, segment, s, t)) continue;
    witness = {edge + s * Vector3::Unit(i), segment.at(t), normal, distance};
  }
  return witness;
}

}  // namespace

void sphere_box(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Vector3 center = X_WB.rotation.transpose() * (X_WA.translation - X_WB.translation);
  const Vector3 closest = clamp_to(center, b.size);
  if (closest != center) {
    out.add_round(X_WA.translation, a.size[0], X_WB * closest, 0.0, Vector3::UnitZ(), margin);
    return;
  }
  int axis = 0;
  const Vector3 depth = b.size - center.cwiseAbs();
  depth.minCoeff(&axis);
  const double gap = -depth[axis] - a.size[0];
  if (gap >= margin) return;
  const Vector3 normal = X_WB.rotation.col(axis) * (center[axis] < 0.0 ? 1.0 : -1.0);
  out.add(X_WA.translation + (a.size[0] + 0.5 * gap) * normal, normal, gap);
}

void box_capsule(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                 const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Matrix3& R = X_WA.rotation;
  const Segment segment{R.transpose() * (X_WB.translation - X_WA.translation),
                        R.transpose() * X_WB.rotation.col(2), b.size[1]};
  const double scale = a.size.sum() + b.size[1] + b.size[0];
  Witness witness;
  witness.point_b = segment.at(closest_parameter(segment, a.size));
  witness.point_a = clamp_to(witness.point_b, a.size);
  witness.normal = witness.point_b - witness.point_a;
  witness.distance = witness.normal.norm();
  // Below this distance the difference of the points is round-off.
  if (witness.distance > 1e-12 * scale) {
    witness.normal /= witness.distance;
  } else {
    witness = segment_in_box(segment, a.size);
  }
  if (witness.distance - b.size[0] >= margin) return;
  Feature face;
  box_feature(a, Pose{}, witness.normal, face);
  Feature line;
  line.size = 2;
  line.radius = b.size[0];
  line.vertices[0] = segment.at(-segment.half_length);
  line.vertices[1] = segment.at(segment.half_length);
  feature_contacts(face, line, witness, kSameGap * scale, margin, out);
  for (int i = 0; i < out.size; ++i) {
    out.points[i].position = X_WA * out.points[i].position;
    out.points[i].normal = R * out.points[i].normal;
  }
}

}  // namespace counterpoint::collision
