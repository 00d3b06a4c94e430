#include "counterpoint/collision/convex/feature.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "counterpoint/collision/shapes/segment.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

using Vector4 = Eigen::Vector4d;

constexpr int kMaxPatch = 2 * Feature::kCapacity;  // each edge of a window can add a corner

// A polygon in the frame of the contact normal: z is the height along it.
struct Patch {
  std::array<Vector3, kMaxPatch> points;
  int size = 0;
};

// The plane of a feature as a height along n: z = offset + slope . (x, y).
struct HeightField {
  double offset, slope_x, slope_y;
  double at(const Vector3& p) const { return offset + slope_x * p.x() + slope_y * p.y(); }
};

Vector3 to_frame(const Matrix3& frame, const Vector3& p) { return frame.transpose() * p; }

HeightField height_field(const Matrix3& frame, const Feature& f) {
  const Vector3 normal = to_frame(frame, f.normal);
  const double offset = f.normal.dot(f.vertices[0]);
  return {offset / normal.z(), -normal.x() / normal.z(), -normal.y() / normal.z()};
}

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

// Clips `subject` (polygon or segment) to the polygon `window`, both projected along the normal.
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

// Contact points before the reduction to at most eight, in the frame of the normal.
struct PatchContacts {
  std::array<Vector3, kMaxPatch + 1> positions;
  std::array<double, kMaxPatch + 1> gaps;
  int size = 0;

  void add(const Vector3& position, double gap) {
    positions[size] = position;
    gaps[size++] = gap;
  }
  void remove(int i) {
    for (int k = i + 1; k < size; ++k) {
      positions[k - 1] = positions[k];
      gaps[k - 1] = gaps[k];
    }
    --size;
  }
};

// Merges adjacent corners closer than `tolerance`; the smaller gap stays.
void merge_neighbours(double tolerance, PatchContacts& c) {
  for (int i = 0; c.size > 1 && i < c.size;) {
    const int next = i + 1 == c.size ? 0 : i + 1;
    if ((c.positions[next] - c.positions[i]).squaredNorm() < tolerance * tolerance) {
      c.remove(c.gaps[next] < c.gaps[i] ? i : next);
    } else {
      ++i;
    }
  }
}

int deepest(const PatchContacts& c) {
  return static_cast<int>(std::min_element(c.gaps.begin(), c.gaps.begin() + c.size) -
                          c.gaps.begin());
}

// Twice the area of the triangle of corner i and its neighbours: the area lost without the corner.
double corner_area(const PatchContacts& c, int i) {
  const Vector3 u = c.positions[i] - c.positions[i == 0 ? c.size - 1 : i - 1];
  const Vector3 v = c.positions[i + 1 == c.size ? 0 : i + 1] - c.positions[i];
  return std::abs(u.x() * v.y() - u.y() * v.x());
}

// Removes the corners that cost least area until seven remain. Gaps are ignored: on a resting body
// they are noise.
void keep_seven(PatchContacts& c) {
  // Factor below 1: areas of a regular polygon differ by round-off.
  constexpr double kLess = 1.0 - 1e-6;
  while (c.size >= Manifold::kCapacity) {
    int least = 0;
    double least_area = corner_area(c, 0);
    for (int i = 1; i < c.size; ++i) {
      const double area = corner_area(c, i);
      if (area >= kLess * least_area) continue;
      least = i;
      least_area = area;
    }
    c.remove(least);
  }
}

// Raises gaps below the witness's to it: no point of the features is closer than the witness, and
// smaller gaps come from faces that are not quite flat or from clipping slightly beyond them.
// Returns whether the least gap equals the witness's to `tolerance`. It is not lowered to it:
// round-off would choose one of several equally deep corners, and at rest 1e-11 m make a quarter of
// a body's weight.
bool settle_gaps(double witness_gap, double tolerance, PatchContacts& c) {
  const bool reached = c.size > 0 && c.gaps[deepest(c)] <= witness_gap + tolerance;
  for (int i = 0; i < c.size; ++i) c.gaps[i] = std::max(c.gaps[i], witness_gap);
  return reached;
}

// Reduces a whole circle to every fourth sample, starting with the deepest: a square carries load
// in the same way at any rotation.
void keep_square(PatchContacts& c) {
  const PatchContacts all = c;
  const int first = deepest(all);
  c.size = 0;
  for (int k = 0; k < 4; ++k) {
    const int i = (first + k * all.size / 4) % all.size;
    c.add(all.positions[i], all.gaps[i]);
  }
}

// True if a polygon can be clipped against: neither edge-on nor with an edge shorter than
// `tolerance`.
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

// Adds the ends of the stretch over which two nearly parallel segments face each other, along the
// witness's normal; then the witness, if it is closer than both.
void segment_contacts(const Feature& a, const Feature& b, const Witness& witness, double tolerance,
                      double margin, Manifold& out) {
  const Vector3 da = a.vertices[1] - a.vertices[0];
  const Vector3 db = b.vertices[1] - b.vertices[0];
  const double radius = a.radius + b.radius;
  const double length2 = da.squaredNorm();
  // Sine of the angle up to which segments count as parallel; there the points are off the surfaces
  // by 1e-7 of their size.
  constexpr double kParallelSine = 1e-3;
  double least = margin;
  if (da.cross(db).norm() < kParallelSine * da.norm() * db.norm()) {
    const double at0 = da.dot(b.vertices[0] - a.vertices[0]) / length2;
    const double at1 = da.dot(b.vertices[1] - a.vertices[0]) / length2;
    const double low = std::max(0.0, std::min(at0, at1));
    const double high = std::min(1.0, std::max(at0, at1));
    for (const double s : {low, high}) {
      if (low >= high) break;
      const Vector3 p = a.vertices[0] + s * da;
      const Vector3 q = b.vertices[0] + ((s - at0) / (at1 - at0)) * db;
      const double distance = witness.normal.dot(q - p);
      if (distance - radius >= margin) continue;
      least = std::min(least, distance - radius);
      out.add(0.5 * (p + q + witness.normal * (a.radius - b.radius)), witness.normal,
              distance - radius);
    }
  }
  if (witness.distance - radius < least - tolerance) {
    out.add(0.5 * (witness.point_a + witness.point_b + witness.normal * (a.radius - b.radius)),
            witness.normal, witness.distance - radius);
  }
}

}  // namespace

void box_feature(const Shape& box, const Pose& X, const Vector3& direction, Feature& out) {
  const Vector3 local = X.rotation.transpose() * direction;
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(local[i]) > std::abs(local[axis])) axis = i;
  }
  const double sign = local[axis] < 0.0 ? -1.0 : 1.0;
  const int u = axis == 2 ? 0 : axis + 1;
  const int v = u == 2 ? 0 : u + 1;
  out.normal = sign * X.rotation.col(axis);
  const Vector3 center = X.translation + box.size[axis] * out.normal;
  const Vector3 eu = box.size[u] * X.rotation.col(u);
  const Vector3 ev = (sign * box.size[v]) * X.rotation.col(v);
  out.vertices[0] = center - eu - ev;
  out.vertices[1] = center + eu - ev;
  out.vertices[2] = center + eu + ev;
  out.vertices[3] = center - eu + ev;
  out.size = 4;
  out.radius = 0.0;
}

void feature_contacts(const Feature& a, const Feature& b, const Witness& witness, double tolerance,
                      double margin, Manifold& out) {
  if (a.size == 2 && b.size == 2) {
    segment_contacts(a, b, witness, tolerance, margin, out);
    return;
  }
  const Matrix3 frame = frame_from_normal(witness.normal);
  const double radius = a.radius + b.radius;
  const bool a_faces = faces(a, witness.normal, tolerance);
  const bool b_faces = faces(b, -witness.normal, tolerance);
  PatchContacts contacts;
  const double center_shift = 0.5 * (a.radius - b.radius);
  const auto add = [&](const Vector3& point, double height_a, double height_b) {
    const double gap = height_b - height_a - radius;
    if (gap >= margin) return;
    contacts.add({point.x(), point.y(), 0.5 * (height_a + height_b) + center_shift}, gap);
  };
  Patch patch;
  if (a_faces && b_faces) {
    clip_to_polygon(frame, a, b, tolerance, patch);
    const HeightField on_a = height_field(frame, a);
    const HeightField on_b = height_field(frame, b);
    for (int i = 0; i < patch.size; ++i)
      add(patch.points[i], on_a.at(patch.points[i]), on_b.at(patch.points[i]));
  } else if (b_faces && a.size == 2) {
    clip_to_polygon(frame, a, b, tolerance, patch);
    const HeightField on_b = height_field(frame, b);
    for (int i = 0; i < patch.size; ++i)
      add(patch.points[i], patch.points[i].z(), on_b.at(patch.points[i]));
  } else if (a_faces && b.size == 2) {
    clip_to_polygon(frame, b, a, tolerance, patch);
    const HeightField on_a = height_field(frame, a);
    for (int i = 0; i < patch.size; ++i) {
      add(patch.points[i], on_a.at(patch.points[i]), patch.points[i].z());
    }
  }
  const bool whole_circle =
      (a.round || b.round) && patch.size == Feature::kCapacity && contacts.size == patch.size;
  // Ten times the clipping tolerance, since a corner may be off by slightly more than that
  // tolerance.
  merge_neighbours(10.0 * tolerance, contacts);
  const bool reached = settle_gaps(witness.distance - radius, tolerance, contacts);
  if (!reached && !witness.found) return;
  if (whole_circle) keep_square(contacts);
  if (!reached) {
    keep_seven(contacts);
    const double height = frame.col(2).dot(witness.point_a);
    add(to_frame(frame, 0.5 * (witness.point_a + witness.point_b)), height,
        height + witness.distance);
  } else if (contacts.size > Manifold::kCapacity) {
    const int lowest = deepest(contacts);
    const Vector3 position = contacts.positions[lowest];
    const double gap = contacts.gaps[lowest];
    keep_seven(contacts);
    if (contacts.gaps[deepest(contacts)] > gap) contacts.add(position, gap);
  }
  for (int i = 0; i < contacts.size; ++i) {
    out.add(frame * contacts.positions[i], witness.normal, contacts.gaps[i]);
  }
}

namespace {

/// Integrates the depth over a segment: the cross-section of a depth d has the area 4/3 d sqrt(2 R
/// d), of a sharp one d^2. Each cap of a ball adds half of pi R d^2.
double segment_volume(double length, double gap_0, double gap_1, double radius, bool has_caps) {
  const double d0 = std::max(-gap_0, 0.0), d1 = std::max(-gap_1, 0.0);
  if (!(gap_0 < 0.0) || !(gap_1 < 0.0)) length *= (d0 + d1) / std::abs(gap_1 - gap_0);
  const auto section = [radius](double d) {
    return radius > 0.0 ? 4.0 / 3.0 * d * std::sqrt(2.0 * radius * d) : d * d;
  };
  const double mean = (section(d0) + 4.0 * section(0.5 * (d0 + d1)) + section(d1)) / 6.0;
  const double caps = has_caps ? 0.5 * std::numbers::pi * radius * (d0 * d0 + d1 * d1) : 0.0;
  return (d0 + d1 > 0.0 ? length * mean : 0.0) + caps;
}

/// Volume of a ball of this radius, or of a sharp cone, sunk into a plane by d.
double point_volume(double d, double radius) {
  return std::numbers::pi * d * d * (radius > 0.0 ? radius : d / 3.0);
}

/// Twice the signed area of the triangle o, p, q in the plane.
double twice_area(const Vector4& o, const Vector4& p, const Vector4& q) {
  return (p.x() - o.x()) * (q.y() - o.y()) - (p.y() - o.y()) * (q.x() - o.x());
}

}  // namespace

void add_overlap(const Feature& a, const Feature& b, const Vector3& normal, const GapShift& shift,
                 OverlapRegion& out) {
  if (!faces(a, normal, 0.0) || !faces(b, -normal, 0.0)) return;
  const Matrix3 frame = frame_from_normal(normal);
  Patch patch;
  clip_to_polygon(frame, a, b, 0.0, patch);
  const HeightField on_a = height_field(frame, a), on_b = height_field(frame, b);
  /// The place, the depth and the height.
  const auto corner = [&](int i) {
    const Vector3& p = patch.points[i];
    const double height_a = on_a.at(p), height_b = on_b.at(p);
    return Vector4(p.x(), p.y(), height_a - height_b, 0.5 * (height_a + height_b));
  };
  const auto later = [&](const Vector4& p) {
    return p[2] - shift.at(frame * Vector3(p.x(), p.y(), p[3]));
  };
  std::array<Vector4, 2 * kMaxPatch> wet;
  int size = 0;
  for (int i = 0; i < patch.size; ++i) {
    const Vector4 p = corner(i), q = corner(i + 1 == patch.size ? 0 : i + 1);
    const double deep_p = later(p), deep_q = later(q);
    if (deep_p >= 0.0) wet[size++] = p;
    if ((deep_p < 0.0) != (deep_q < 0.0)) wet[size++] = p + deep_p / (deep_p - deep_q) * (q - p);
  }
  for (int i = 1; i + 1 < size; ++i) {
    const Vector4 &o = wet[0], &p = wet[i], &q = wet[i + 1];
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

double round_overlap(const Feature& a, const Feature& b, const Vector3& normal,
                     const GapShift& shift, double radius, bool has_caps, double deepest) {
  const bool a_faces = faces(a, normal, 0.0), b_faces = faces(b, -normal, 0.0);
  if (!(a_faces && b.size == 2) && !(b_faces && a.size == 2))
    return point_volume(std::max(-deepest, 0.0), radius);
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
