#include "counterpoint/collision/convex/feature_pairs.h"

#include <cmath>

#include "counterpoint/collision/shapes/segment.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

// The farthest point of a piece along a direction; for a rim also the derivative of that point.
struct Reach {
  Vector3 point;
  Vector3 tangent = Vector3::Zero();  // unit
  double rate = 0.0;  // displacement along the tangent per radian of the direction [m]
};

Reach reach(const Piece& piece, const Vector3& direction) {
  Reach r{piece.center};
  if (piece.kind != Piece::kRim) return r;
  const Vector3 across = direction - direction.dot(piece.axis) * piece.axis;
  const double length = across.norm();
  if (!(length > 0.0)) return r;
  const Vector3 radial = across / length;
  r.point += piece.size * radial;
  r.tangent = piece.axis.cross(radial);
  r.rate = piece.size / length;
  return r;
}

// Newton's method for the normal n that maximizes the distance n . w(n) of two points or rims, w
// from A's to B's. The gradient is w, the Hessian -(n . w) 1 - sum rate tangent tangent', both
// restricted to the plane perpendicular to n. `fixed`: null, or the direction of a line to which n
// stays perpendicular.
bool newton(const Piece& a, const Piece& b, const Vector3* fixed, Vector3& n) {
  constexpr int kMaxIterations = 12;    // quadratic convergence: six are usual
  constexpr double kLastStep = 1e-8;    // [rad]: the next step would be its square
  constexpr double kLongestStep = 0.5;  // [rad]
  for (int i = 0; i < kMaxIterations; ++i) {
    if (fixed != nullptr) n = (n - n.dot(*fixed) * *fixed).normalized();
    const Reach ra = reach(a, n);
    const Reach rb = reach(b, -n);
    const Vector3 w = rb.point - ra.point;
    const double distance = n.dot(w);
    const auto curvature = [&](const Vector3& s, const Vector3& t) {
      return distance * s.dot(t) + ra.rate * ra.tangent.dot(s) * ra.tangent.dot(t) +
             rb.rate * rb.tangent.dot(s) * rb.tangent.dot(t);
    };
    Vector3 step;
    if (fixed != nullptr) {
      const Vector3 t = n.cross(*fixed);
      const double c = curvature(t, t);
      if (!(c > 0.0)) return false;
      step = (t.dot(w) / c) * t;
    } else {
      const Matrix3 frame = frame_from_normal(n);
      const Vector3 s = frame.col(0);
      const Vector3 t = frame.col(1);
      const double ss = curvature(s, s);
      const double st = curvature(s, t);
      const double tt = curvature(t, t);
      const double determinant = ss * tt - st * st;
      if (!(ss > 0.0 && determinant > 0.0)) return false;
      const double gs = s.dot(w);
      const double gt = t.dot(w);
      step = ((tt * gs - st * gt) / determinant) * s + ((ss * gt - st * gs) / determinant) * t;
    }
    const double length = step.norm();
    if (length > kLongestStep) step *= kLongestStep / length;
    n = (n + step).normalized();
    if (length < kLastStep) return true;
  }
  return false;
}

Segment segment(const Piece& line) { return {line.center, line.axis, line.size}; }

// Sets `out` to the point nearest to p on a line; true if it lies between the ends.
bool on_line(const Piece& line, const Vector3& p, double slack, Vector3& out) {
  const double t = line.axis.dot(p - line.center);
  out = line.center + t * line.axis;
  return std::abs(t) <= line.size + slack;
}

// Finds the closest points and the normal of two pieces, no faces, from an initial normal.
bool solve(const Piece& a, const Piece& b, double slack, Witness& out) {
  Vector3& n = out.normal;
  const bool line_a = a.kind == Piece::kLine;
  const bool line_b = b.kind == Piece::kLine;
  bool inside = true;
  if (line_a && line_b) {
    const Vector3 cross = a.axis.cross(b.axis);
    double s = 0.0;
    double t = 0.0;
    if (!closest_on_lines(segment(a), segment(b), s, t)) return false;
    n = cross.dot(n) < 0.0 ? Vector3(-cross.normalized()) : Vector3(cross.normalized());
    out.point_a = segment(a).at(s);
    out.point_b = segment(b).at(t);
    inside = std::abs(s) <= a.size + slack && std::abs(t) <= b.size + slack;
  } else {
    if (!newton(a, b, line_a ? &a.axis : line_b ? &b.axis : nullptr, n)) return false;
    out.point_a = reach(a, n).point;
    out.point_b = reach(b, -n).point;
    if (line_a) inside = on_line(a, out.point_b, slack, out.point_a);
    if (line_b) inside = on_line(b, out.point_a, slack, out.point_b);
  }
  out.point_a += a.radius * n;
  out.point_b -= b.radius * n;
  return inside;
}

// Sets the witness's distance to that of the cores along its normal. True if the witness's points,
// which lie in the cores, have this distance, and it is no less than `least`.
bool certain(const MinkowskiDifference& difference, double least, Witness& witness) {
  constexpr double kError = 1e-13;  // a hundred times the round-off, relative to the size
  const Vector3 apart = witness.point_b - witness.point_a;
  witness.distance = difference.distance_along(witness.normal);
  return witness.distance >= least &&
         std::abs(witness.normal.dot(apart) - witness.distance) <= kError * difference.scale &&
         (apart - witness.distance * witness.normal).norm() <= 1e2 * kError * difference.scale;
}

// Copies the distinct points among the given ones, of A or of B; returns their number.
int distinct(const DifferencePoint* points, int num_points, bool of_a, Vector3* out) {
  int size = 0;
  for (int i = 0; i < num_points; ++i) {
    const Vector3& p = of_a ? points[i].a : points[i].b;
    bool known = false;
    for (int k = 0; k < size; ++k) known = known || out[k] == p;
    if (!known) out[size++] = p;
  }
  return size;
}

constexpr int kMaxPieces = 4;  // a triangle has the most: a face and three edges

Piece line_through(const Vector3& p, const Vector3& q) {
  return {Piece::kLine, 0.5 * (p + q), (q - p).normalized(), 0.5 * (q - p).norm(), 0.0};
}

// Lists at most kMaxPieces pieces of a core that may touch, the likeliest first; returns their
// number.
int candidates(const CoreShape& core, const Vector3* points, int size, const Vector3& towards,
               Piece* out) {
  if (core.shape.type != ShapeType::kCylinder) {
    if (size == 1) {
      out[0].center = points[0];
      return 1;
    }
    if (size == 2) {
      out[0] = line_through(points[0], points[1]);
      return 1;
    }
    for (int i = 0; i < 3; ++i) out[i + 1] = line_through(points[i], points[i == 2 ? 0 : i + 1]);
    out[0].kind = Piece::kFace;
    out[0].axis = (points[1] - points[0]).cross(points[2] - points[0]).normalized();
    if (out[0].axis.dot(towards) < 0.0) out[0].axis = -out[0].axis;
    return 4;
  }
  // Sine of the angle between the normal and the plane across the axis below which the side may
  // touch.
  constexpr double kSideSine = 0.3;
  const Vector3 axis = core.X.rotation.col(2);
  const double half = core.shape.size[1];
  const double sine = axis.dot(towards);
  int ends = 0;
  double height = 0.0;
  for (int i = 0; i < size; ++i) {
    const double z = axis.dot(points[i] - core.X.translation);
    ends |= z < 0.0 ? 1 : 2;
    height += z;
  }
  Piece side{Piece::kLine, core.X.translation, axis, half, core.shape.size[0]};
  Piece rim{Piece::kRim, core.X.translation + (height < 0.0 ? -half : half) * axis, axis,
            core.shape.size[0], 0.0};
  int count = 0;
  if (ends == 3 && std::abs(sine) < kSideSine) out[count++] = side;
  out[count++] = rim;
  if (ends == 3 && count == 2) {
    out[count] = rim;
    out[count++].center = core.X.translation + (height < 0.0 ? half : -half) * axis;
  }
  return count;
}

// Tries a face of A or B through `origin`, whose outward normal is known: the farthest point of the
// other core must lie over the face, that is, `holds` is true for its foot.
template <typename Holds>
bool settle_on_face(const MinkowskiDifference& difference, const Vector3& origin,
                    const Vector3& outward, bool of_a, const Holds& holds, double least,
                    Witness& out) {
  out.normal = of_a ? outward : Vector3(-outward);
  const DifferencePoint p = difference.support(-out.normal);
  const Vector3& tip = of_a ? p.b : p.a;
  const Vector3 foot = tip - outward.dot(tip - origin) * outward;
  if (!holds(foot)) return false;
  out.point_a = of_a ? foot : tip;
  out.point_b = of_a ? tip : foot;
  return certain(difference, least, out);
}

bool settle_on_triangle(const MinkowskiDifference& difference, const Vector3* triangle,
                        const Vector3& outward, bool of_a, double least, Witness& out) {
  const double turn = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).dot(outward);
  const auto holds = [&](const Vector3& foot) {
    for (int i = 0; i < 3; ++i) {
      const Vector3& from = triangle[i];
      const Vector3& to = triangle[i == 2 ? 0 : i + 1];
      if ((to - from).cross(foot - from).dot(outward) * turn < 0.0) return false;
    }
    return true;
  };
  return settle_on_face(difference, triangle[0], outward, of_a, holds, least, out);
}

// Tries the cap of a cylinder, if it faces along the normal.
bool settle_on_cap(const MinkowskiDifference& difference, const CoreShape& core,
                   const Vector3& towards, bool of_a, double least, Witness& out) {
  constexpr double kCapCosine = 0.9;  // within 26 degrees; elsewhere the rim or the side touches
  if (core.shape.type != ShapeType::kCylinder) return false;
  const Vector3 axis = core.X.rotation.col(2);
  const double cosine = axis.dot(towards);
  if (std::abs(cosine) < kCapCosine) return false;
  const Vector3 outward = cosine < 0.0 ? Vector3(-axis) : axis;
  const Vector3 center = core.X.translation + core.shape.size[1] * outward;
  const auto holds = [&](const Vector3& foot) {
    return (foot - center).squaredNorm() <= core.shape.size[0] * core.shape.size[0];
  };
  return settle_on_face(difference, center, outward, of_a, holds, least, out);
}

}  // namespace

bool settle_on_feature_pair(const MinkowskiDifference& difference, const DifferencePoint* points,
                            int num_points, const Vector3& normal, double least, Witness& out) {
  Vector3 points_a[3];
  Vector3 points_b[3];
  const int size_a = distinct(points, num_points, true, points_a);
  const int size_b = distinct(points, num_points, false, points_b);
  Piece pieces_a[kMaxPieces];
  Piece pieces_b[kMaxPieces];
  const int count_a = candidates(difference.a, points_a, size_a, normal, pieces_a);
  const int count_b = candidates(difference.b, points_b, size_b, -normal, pieces_b);
  if (settle_on_cap(difference, difference.a, normal, true, least, out) ||
      settle_on_cap(difference, difference.b, -normal, false, least, out)) {
    return true;
  }
  const bool face_a = pieces_a[0].kind == Piece::kFace;
  const bool face_b = pieces_b[0].kind == Piece::kFace;
  if (face_a && settle_on_triangle(difference, points_a, pieces_a[0].axis, true, least, out))
    return true;
  if (face_b && settle_on_triangle(difference, points_b, pieces_b[0].axis, false, least, out))
    return true;
  const double slack = 1e-13 * difference.scale;
  for (int i = face_a; i < count_a; ++i) {
    for (int k = face_b; k < count_b; ++k) {
      out.normal = normal;
      if (solve(pieces_a[i], pieces_b[k], slack, out) && certain(difference, least, out))
        return true;
    }
  }
  return false;
}

}  // namespace counterpoint::collision
