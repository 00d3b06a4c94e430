#include "counterpoint/collision/convex/clip.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::collision {
namespace {

// Clips off the part to the right of the line from p to q (Sutherland, Hodgman 1974). Points within
// `tolerance` of the line stay, so that round-off does not decide about coinciding edges.
void clip(const Vector3& p, const Vector3& q, double tolerance, const Patch& in, Patch& out) {
  out.size = 0;
  double ex = q.x() - p.x();
  double ey = q.y() - p.y();
  const double length = std::sqrt(ex * ex + ey * ey);
  if (length <= tolerance) {
    out = in;
    return;
  }
  ex /= length;
  ey /= length;
  const auto side = [&](const Vector3& v) {
    return ex * (v.y() - p.y()) - ey * (v.x() - p.x()) + tolerance;
  };
  const int edges = in.size == 2 ? 1 : in.size;
  double side_i = side(in.points[0]);
  if (in.size == 2 && side_i >= 0.0) out.points[out.size++] = in.points[0];
  for (int i = 0; i < edges; ++i) {
    const Vector3& current = in.points[i];
    const Vector3& next = in.points[i + 1 == in.size ? 0 : i + 1];
    const double side_next = side(next);
    if ((side_i >= 0.0) != (side_next >= 0.0) && out.size < kMaxPatch) {
      out.points[out.size++] = current + (side_i / (side_i - side_next)) * (next - current);
    }
    if (side_next >= 0.0 && out.size < kMaxPatch) out.points[out.size++] = next;
    side_i = side_next;
  }
}

}  // namespace

void clip_to_polygon(const Matrix3& frame, const Feature& subject, const Feature& window,
                     double tolerance, Patch& out) {
  std::array<Vector3, Feature::kCapacity> corners;
  for (int i = 0; i < window.size; ++i) corners[i] = to_frame(frame, window.vertices[i]);
  Patch buffer;
  Patch* from = &out;
  Patch* to = &buffer;
  from->size = subject.size;
  for (int i = 0; i < subject.size; ++i) from->points[i] = to_frame(frame, subject.vertices[i]);
  const bool reversed = window.normal.dot(frame.col(2)) < 0.0;
  for (int i = 0; i < window.size && from->size > 0; ++i) {
    const Vector3& p = corners[i];
    const Vector3& q = corners[i + 1 == window.size ? 0 : i + 1];
    if (reversed) {
      clip(q, p, tolerance, *from, *to);
    } else {
      clip(p, q, tolerance, *from, *to);
    }
    std::swap(from, to);
  }
  if (from != &out) {
    out.size = from->size;
    std::copy_n(from->points.begin(), from->size, out.points.begin());
  }
}

bool faces(const Feature& f, const Vector3& direction, double tolerance) {
  constexpr double kEdgeOn =
      0.02;  // cosine: there the tolerance makes heights uncertain by 50 times its value
  if (f.size < 3 || !(f.normal.dot(direction) > kEdgeOn)) return false;
  for (int i = 0; i < f.size; ++i) {
    const Vector3& next = f.vertices[i + 1 == f.size ? 0 : i + 1];
    if (!((next - f.vertices[i]).squaredNorm() > tolerance * tolerance)) return false;
  }
  return true;
}

}  // namespace counterpoint::collision
