#include "counterpoint/collision/convex/overlap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "counterpoint/collision/convex/clip.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

using Vector4 = Eigen::Vector4d;

/// Integrates the depth over a segment: the cross-section of a depth d has the area 4/3 d sqrt(2 R
/// d). Each cap of a ball adds half of pi R d^2.
double segment_volume(double length, double gap_0, double gap_1, double radius, bool has_caps) {
  const double d0 = std::max(-gap_0, 0.0), d1 = std::max(-gap_1, 0.0);
  if (!(gap_0 < 0.0) || !(gap_1 < 0.0)) length *= (d0 + d1) / std::abs(gap_1 - gap_0);
  const auto section = [radius](double d) { return 4.0 / 3.0 * d * std::sqrt(2.0 * radius * d); };
  const double mean = (section(d0) + 4.0 * section(0.5 * (d0 + d1)) + section(d1)) / 6.0;
  const double caps = has_caps ? 0.5 * std::numbers::pi * radius * (d0 * d0 + d1 * d1) : 0.0;
  return (d0 + d1 > 0.0 ? length * mean : 0.0) + caps;
}

/// Twice the signed area of the triangle o, p, q in the plane.
double twice_area(const Vector4& o, const Vector4& p, const Vector4& q) {
  return (p.x() - o.x()) * (q.y() - o.y()) - (p.y() - o.y()) * (q.x() - o.x());
}

/// Adds the integrals over a polygon of which the corners are a place and the fields.
void add_polygon(std::span<const Vector4> corners, OverlapRegion& out) {
  for (size_t i = 1; i + 1 < corners.size(); ++i) {
    const Vector4 &o = corners[0], &p = corners[i], &q = corners[i + 1];
    // The middles of the edges integrate polynomials of degree 2 exactly.
    const double third = std::abs(twice_area(o, p, q)) / 6.0;
    for (const Vector4& x :
         {Vector4(0.5 * (o + p)), Vector4(0.5 * (p + q)), Vector4(0.5 * (q + o))}) {
      const auto place = x.head<2>(), fields = x.tail<2>();
      out.area += third;
      out.place += third * place;
      out.places += third * place * place.transpose();
      out.fields += third * fields;
      out.moments += third * place * fields.transpose();
    }
  }
}

}  // namespace

void add_overlap(const Feature& a, const Feature& b, const Vector3& normal, const GapShift& shift,
                 OverlapRegion& now, OverlapRegion& later) {
  if (!faces(a, normal, 0.0) || !faces(b, -normal, 0.0)) return;
  const Matrix3 frame = frame_from_normal(normal);
  Patch patch;
  clip_to_polygon(frame, a, b, 0.0, patch);
  const HeightField on_a = height_field(frame, a), on_b = height_field(frame, b);
  const auto corner = [&](int i) {
    const Vector3& p = patch.points[i];
    const double height_a = on_a.at(p), height_b = on_b.at(p);
    return Vector4(p.x(), p.y(), height_a - height_b, 0.5 * (height_a + height_b));
  };
  std::array<Vector4, 2 * kMaxPatch> wet;
  const auto add = [&](const GapShift& by, OverlapRegion& out) {
    size_t size = 0;
    const auto depth = [&](const Vector4& p) {
      return p[2] - by.at(frame * Vector3(p.x(), p.y(), p[3]));
    };
    for (int i = 0; i < patch.size; ++i) {
      const Vector4 p = corner(i), q = corner(i + 1 == patch.size ? 0 : i + 1);
      const double deep_p = depth(p), deep_q = depth(q);
      if (deep_p >= 0.0) wet[size++] = p;
      if ((deep_p < 0.0) != (deep_q < 0.0)) wet[size++] = p + deep_p / (deep_p - deep_q) * (q - p);
    }
    add_polygon({wet.data(), size}, out);
  };
  add(GapShift(), now);
  add(shift, later);
}

double round_overlap(const Feature& a, const Feature& b, const Vector3& normal,
                     const GapShift& shift, double radius, bool has_caps, double deepest) {
  const bool a_faces = faces(a, normal, 0.0), b_faces = faces(b, -normal, 0.0);
  if (!(a_faces && b.size == 2) && !(b_faces && a.size == 2))
    return std::numbers::pi * radius * std::min(deepest, 0.0) * std::min(deepest, 0.0);
  const Matrix3 frame = frame_from_normal(normal);
  Patch line;
  clip_to_polygon(frame, a_faces ? b : a, a_faces ? a : b, 0.0, line);
  if (line.size < 2) return 0.0;
  const auto gap = [&](int i) {
    const Vector3& p = line.points[i];
    const double height_a = a_faces ? height_field(frame, a).at(p) : p.z();
    const double height_b = b_faces ? height_field(frame, b).at(p) : p.z();
    return height_b - height_a - a.radius - b.radius +
           shift.at(frame * Vector3(p.x(), p.y(), 0.5 * (height_a + height_b)));
  };
  const double length = (line.points[1] - line.points[0]).norm();
  return segment_volume(length, gap(0), gap(1), radius, has_caps);
}

}  // namespace counterpoint::collision
