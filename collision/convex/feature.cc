#include "counterpoint/collision/convex/feature.h"

#include <algorithm>
#include <limits>

#include "counterpoint/collision/convex/clip.h"
#include "counterpoint/collision/shapes/segment.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

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

}  // namespace counterpoint::collision
