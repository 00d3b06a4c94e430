#include "counterpoint/model/parts/tendon.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {
namespace {

/// Sine of the angle between the ends below which the plane of a path is undetermined.
constexpr double kOneLine = 1e-12;

/// Rounding of the arc of a path [rad]: a straight line that touches has the arc 0, plus or minus
/// the rounding of poses over the radius.
constexpr double kNoArc = 1e-9;

/// A path around a circle in the plane of a and b: unit vectors along a and b, and across them
/// towards each other.
struct Circle {
  double r = 0.0, size_a = 0.0, size_b = 0.0;
  Vector3 e_a, e_b, t_a, t_b, n;
  double angle = 0.0;  ///< between a and b, 0 ... pi [rad]
  double sign = 1.0;   ///< -1: around the far side
  bool touches = false;
};

/// Angle between an end and the point at which its tangent touches [rad].
double tangent_angle(double r, double size) { return std::acos(std::min(1.0, r / size)); }

/// Completes a circle whose e_a, e_b, angle, t_a, t_b are known: decides whether and on which side
/// the path touches. side: a point on the side that it passes, or null.
void choose_side(const Vector3& a, const Vector3& b, const Vector3* side, Circle& c) {
  const Vector3 way = b - a;
  const double length = way.squaredNorm();
  const double part = length > 0.0 ? std::clamp(-a.dot(way) / length, 0.0, 1.0) : 0.0;
  const Vector3 nearest = a + part * way;
  if (nearest.norm() > c.r && (!side || side->dot(nearest) >= 0.0)) return;
  const double alpha = tangent_angle(c.r, c.size_a), beta = tangent_angle(c.r, c.size_b);
  const bool near_possible = c.angle - alpha - beta >= -kNoArc;
  const auto touching = [&](double sign) {
    const Vector3 at_a = std::cos(alpha) * c.e_a + sign * std::sin(alpha) * c.t_a;
    const Vector3 at_b = std::cos(beta) * c.e_b + sign * std::sin(beta) * c.t_b;
    return Vector3((at_a + at_b).normalized());
  };
  c.touches = true;
  if (!side) {
    c.touches = near_possible;
  } else if (!near_possible || touching(-1.0).dot(*side) > touching(1.0).dot(*side)) {
    c.sign = -1.0;
  }
}

/// Finds the circle of a path around a sphere (axis null) or a cylinder with this axis, whose a and
/// b are across it.
Circle find_circle(double r, const Vector3& a, const Vector3& b, const Vector3* axis,
                   const Vector3* side) {
  Circle c;
  c.r = r;
  c.size_a = a.norm();
  c.size_b = b.norm();
  if (!(c.size_a > r && c.size_b > r)) return c;
  c.e_a = a / c.size_a;
  c.e_b = b / c.size_b;
  Vector3 n = c.e_a.cross(c.e_b);
  const double sine = n.norm(), cosine = c.e_a.dot(c.e_b);
  c.angle = std::atan2(sine, cosine);
  if (sine > kOneLine) {
    n /= sine;
  } else {  // any plane through both, towards the side if it is given
    n = axis                                                          ? *axis
        : side && c.e_a.cross(*side).norm() > kOneLine * side->norm() ? c.e_a.cross(*side)
                                                                      : c.e_a.unitOrthogonal();
    n.normalize();
  }
  c.n = n;
  c.t_a = n.cross(c.e_a);
  c.t_b = -n.cross(c.e_b);
  choose_side(a, b, side, c);
  return c;
}

/// f(s) = sqrt(s^2 - r^2) - r acos(r / s) and its derivatives.
struct Tangent {
  double value, first, second;
  Tangent(double r, double s) {
    const double root = std::sqrt(std::max(0.0, (s - r) * (s + r)));
    value = root - r * std::acos(r / s);
    first = root / s;
    second = r * r / (s * s * root);
  }
};

/// Length around a circle. plane: whether the ends stay in the plane of the circle.
SegmentLength circle_length(const Circle& c, bool plane, bool second) {
  const Tangent f_a(c.r, c.size_a), f_b(c.r, c.size_b);
  const double angle = c.sign > 0.0 ? c.angle : 2.0 * M_PI - c.angle, r = c.sign * c.r;
  SegmentLength out;
  out.length = f_a.value + f_b.value + c.r * angle;
  out.by_a = f_a.first * c.e_a - r / c.size_a * c.t_a;
  out.by_b = f_b.first * c.e_b - r / c.size_b * c.t_b;
  if (!second) return out;
  const double sine = std::max(std::sin(c.angle), kOneLine), cosine = std::cos(c.angle);
  const auto same = [&](const Tangent& f, double size, const Vector3& e, const Vector3& t) {
    const double turn = r / (size * size), bend = f.first / size;
    Matrix3 H = f.second * e * e.transpose() + bend * t * t.transpose() +
                turn * (t * e.transpose() + e * t.transpose());
    if (!plane) H += (bend + turn * cosine / sine) * c.n * c.n.transpose();
    return H;
  };
  out.by_aa = same(f_a, c.size_a, c.e_a, c.t_a);
  out.by_bb = same(f_b, c.size_b, c.e_b, c.t_b);
  out.by_ab.setZero();
  if (!plane) out.by_ab = -r / (c.size_a * c.size_b * sine) * c.n * c.n.transpose();
  return out;
}

/// Length sqrt(l^2 + z^2) with z = axis (b - a), from l in the plane.
SegmentLength unrolled(const SegmentLength& l, const Vector3& axis, double z, bool second) {
  SegmentLength out;
  out.length = std::hypot(l.length, z);
  const double L = out.length, by_l = l.length / L, by_z = z / L;
  out.by_a = by_l * l.by_a - by_z * axis;
  out.by_b = by_l * l.by_b + by_z * axis;
  if (!second) return out;
  const double ll = by_z * by_z / L, lz = -by_l * by_z / L, zz = by_l * by_l / L;
  const auto mixed = [&](const Matrix3& H, const Vector3& g, double sign_g, const Vector3& k,
                         double sign_k) {
    return Matrix3(by_l * H + ll * g * k.transpose() + sign_k * lz * g * axis.transpose() +
                   sign_g * lz * axis * k.transpose() +
                   sign_g * sign_k * zz * axis * axis.transpose());
  };
  out.by_aa = mixed(l.by_aa, l.by_a, -1.0, l.by_a, -1.0);
  out.by_ab = mixed(l.by_ab, l.by_a, -1.0, l.by_b, 1.0);
  out.by_bb = mixed(l.by_bb, l.by_b, 1.0, l.by_b, 1.0);
  return out;
}

}  // namespace

SegmentLength straight_length(const Vector3& a, const Vector3& b, bool second) {
  SegmentLength out;
  const Vector3 way = b - a;
  out.length = way.norm();
  const Vector3 u = out.length > 0.0 ? Vector3(way / out.length) : Vector3::Zero();
  out.by_a = -u;
  out.by_b = u;
  if (!second) return out;
  out.by_aa.setZero();
  if (out.length > 0.0) out.by_aa = (Matrix3::Identity() - u * u.transpose()) / out.length;
  out.by_bb = out.by_aa;
  out.by_ab = -out.by_aa;
  return out;
}

SegmentLength wrapped_length(const TendonWrap& wrap, const Matrix3& R_WG, const Vector3& a,
                             const Vector3& b, bool second) {
  Vector3 side = Vector3::Zero();
  if (wrap.side) side = R_WG * *wrap.side;
  const Vector3* toward = wrap.side ? &side : nullptr;
  if (!wrap.cylinder) {
    const Circle circle = find_circle(wrap.radius, a, b, nullptr, toward);
    if (!circle.touches) return straight_length(a, b, second);
    return circle_length(circle, false, second);
  }
  const Vector3 axis = R_WG.col(2);
  const auto across = [&](const Vector3& x) { return Vector3(x - x.dot(axis) * axis); };
  side = across(side);
  const Circle circle = find_circle(wrap.radius, across(a), across(b), &axis, toward);
  if (!circle.touches) return straight_length(a, b, second);
  return unrolled(circle_length(circle, true, second), axis, axis.dot(b - a), second);
}

int reference_body(const Tendon& tendon, const TendonSegment& segment) {
  if (segment.wrap < 0) return segment.from.body;
  return tendon.wraps[static_cast<std::size_t>(segment.wrap)].body;
}

std::set<int> path_bodies(const Tendon& tendon) {
  std::set<int> bodies;
  for (const TendonSegment& segment : tendon.path)
    bodies.insert({segment.from.body, segment.to.body, reference_body(tendon, segment)});
  return bodies;
}

PlacedSegment place_segment(const Tendon& tendon, const TendonSegment& segment,
                            const std::vector<Pose>& X_WB, bool second) {
  PlacedSegment out;
  out.start = X_WB[segment.from.body] * segment.from.position;
  out.end = X_WB[segment.to.body] * segment.to.position;
  if (segment.wrap < 0) {
    out.length = straight_length(out.start, out.end, second);
    return out;
  }
  const TendonWrap& wrap = tendon.wraps[static_cast<std::size_t>(segment.wrap)];
  const Pose X_WG = X_WB[wrap.body] * wrap.X_BG;
  out.length = wrapped_length(wrap, X_WG.rotation, out.start - X_WG.translation,
                              out.end - X_WG.translation, second);
  return out;
}

}  // namespace counterpoint
