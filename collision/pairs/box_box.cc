// Two boxes: separating axis test, then the features that face each other.
#include <algorithm>
#include <limits>

#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/convex/gjk.h"
#include "counterpoint/collision/pairs/pair_functions.h"
#include "counterpoint/collision/shapes/segment.h"

namespace counterpoint::collision {
namespace {

// Relative to the size of the boxes: closer gaps are equal. Faces are preferred to edges by this
// amount, so that round-off does not choose if an edge lies in a face.
constexpr double kSameDistance = 1e-10;

struct Axis {
  double distance = -std::numeric_limits<double>::infinity();  // separation along the axis [m]
  Vector3 normal;                                              // unit, from A to B
  int edge_a = -1, edge_b = -1;  // edge directions; -1: the axis is a face normal of A or B
};

// The two boxes, with quantities that every axis needs.
struct Boxes {
  const Vector3 &half_a, &half_b;
  const Matrix3 &R_a, &R_b;
  Vector3 center;  // centre of B relative to A's, in W [m]
  Matrix3 cosine;  // R_a' R_b
  double scale;
};

// Calls visit(along, distance, axis) for the face normals of A (below: B): the coordinate of B's
// centre relative to A's along the axis and the separation of the boxes along it.
template <class Visit>
void for_faces_of_a(const Boxes& boxes, const Matrix3& absolute_cosine, const Visit& visit) {
  const Vector3 in_a = boxes.R_a.transpose() * boxes.center;
  const Vector3 extent_b = absolute_cosine * boxes.half_b;
  for (int i = 0; i < 3; ++i)
    visit(in_a[i], std::abs(in_a[i]) - boxes.half_a[i] - extent_b[i], boxes.R_a.col(i));
}

template <class Visit>
void for_faces_of_b(const Boxes& boxes, const Matrix3& absolute_cosine, const Visit& visit) {
  const Vector3 in_b = boxes.R_b.transpose() * boxes.center;
  const Vector3 extent_a = absolute_cosine.transpose() * boxes.half_a;
  for (int i = 0; i < 3; ++i)
    visit(in_b[i], std::abs(in_b[i]) - boxes.half_b[i] - extent_a[i], boxes.R_b.col(i));
}

// Returns the face axis of largest separation; stops as soon as one exceeds the margin.
Axis best_face(const Boxes& boxes, double margin) {
  Axis best;
  const Matrix3 absolute = boxes.cosine.cwiseAbs();
  const auto consider = [&](double along, double distance, const Vector3& axis) {
    // Faces of B must win by more than round-off, so that of parallel faces A's is taken.
    if (distance <= best.distance + kSameDistance * boxes.scale) return;
    best.distance = distance;
    best.normal = along < 0.0 ? Vector3(-axis) : axis;
  };
  for_faces_of_a(boxes, absolute, consider);
  if (best.distance >= margin) return best;
  for_faces_of_b(boxes, absolute, consider);
  return best;
}

// Averages the normals of all faces whose separation is within `rounding` of the best, with a
// weight that falls linearly to 0 there. The result is continuous in the poses, and lies in the
// middle where two edges, or two corners, meet. False if all these faces are nearly parallel.
bool rounded_normal(const Boxes& boxes, const Axis& best, double rounding, Vector3& normal) {
  constexpr double kParallel = 0.99;  // cosine of 8 degrees
  Vector3 sum = best.normal;
  bool several = false;
  const auto consider = [&](double along, double distance, const Vector3& axis) {
    const double weight = 1.0 - (best.distance - distance) / rounding;
    const Vector3 outward = along < 0.0 ? Vector3(-axis) : axis;
    if (!(weight > 0.0) || outward.dot(best.normal) > kParallel) return;
    sum += std::min(weight, 1.0) * outward;
    several = true;
  };
  const Matrix3 absolute = boxes.cosine.cwiseAbs();
  for_faces_of_a(boxes, absolute, consider);
  for_faces_of_b(boxes, absolute, consider);
  normal = sum.normalized();
  return several;
}

// Improves on `best` with the cross products of edges. In A's frame a_i x b_j has the components 0,
// -cosine(k, j), cosine(l, j), so no cross product is needed.
void consider_edges(const Boxes& boxes, double margin, Axis& best) {
  const Matrix3& C = boxes.cosine;
  const Vector3 in_a = boxes.R_a.transpose() * boxes.center;
  for (int i = 0; i < 3; ++i) {
    const int k = (i + 1) % 3;
    const int l = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const double sine2 = C(k, j) * C(k, j) + C(l, j) * C(l, j);
      if (sine2 < 1e-16) continue;
      const int m = (j + 1) % 3;
      const int n = (j + 2) % 3;
      const double along = in_a[l] * C(k, j) - in_a[k] * C(l, j);
      const double extent_a =
          boxes.half_a[k] * std::abs(C(l, j)) + boxes.half_a[l] * std::abs(C(k, j));
      const double extent_b =
          boxes.half_b[m] * std::abs(C(i, n)) + boxes.half_b[n] * std::abs(C(i, m));
      const double sine = std::sqrt(sine2);
      const double distance = (std::abs(along) - extent_a - extent_b) / sine;
      if (distance <= best.distance + kSameDistance * boxes.scale) continue;
      best.distance = distance;
      best.normal = (boxes.R_a.col(l) * C(k, j) - boxes.R_a.col(k) * C(l, j)) *
                    ((along < 0.0 ? -1.0 : 1.0) / sine);
      best.edge_a = i;
      best.edge_b = j;
      if (distance >= margin) return;
    }
  }
}

// Returns the edge of a box parallel to `axis` that lies farthest along `direction`.
Segment support_edge(const Vector3& half, const Matrix3& R, const Vector3& center, int axis,
                     const Vector3& direction) {
  Vector3 p = center;
  for (int i = 0; i < 3; ++i) {
    if (i == axis) continue;
    p += R.col(i) * (direction.dot(R.col(i)) < 0.0 ? -half[i] : half[i]);
  }
  return {p, R.col(axis), half[axis]};
}

// Returns the farthest edge along the direction among those most perpendicular to it.
Segment nearest_edge(const Vector3& half, const Matrix3& R, const Vector3& center,
                     const Vector3& direction) {
  int axis = 0;
  (R.transpose() * direction).cwiseAbs().minCoeff(&axis);
  return support_edge(half, R, center, axis, direction);
}

// Adds the contacts of two edges: parallel ones touch at the ends of the stretch where they face
// each other, others at the point where they cross.
void edge_contacts(const Segment& a, const Segment& b, const Vector3& normal, double tolerance,
                   double margin, Manifold& out) {
  const auto feature = [](const Segment& edge) {
    Feature line;
    line.size = 2;
    line.radius = 0.0;
    line.vertices[0] = edge.at(-edge.half_length);
    line.vertices[1] = edge.at(edge.half_length);
    return line;
  };
  double s = 0.0, t = 0.0;
  if (!closest_on_lines(a, b, s, t)) s = t = 0.0;
  const Vector3 on_a = a.at(std::clamp(s, -a.half_length, a.half_length));
  const Vector3 on_b = b.at(std::clamp(t, -b.half_length, b.half_length));
  feature_contacts(feature(a), feature(b), {on_a, on_b, normal, normal.dot(on_b - on_a)}, tolerance,
                   margin, out);
}

Vector3 farthest_corner(const Vector3& half, const Matrix3& R, const Vector3& direction) {
  Vector3 p = Vector3::Zero();
  for (int i = 0; i < 3; ++i) {
    p += R.col(i) * (direction.dot(R.col(i)) < 0.0 ? -half[i] : half[i]);
  }
  return p;
}

// Finds the points that touch along an edge axis. False if the lines of the edges meet beyond their
// ends: the axis then separates the boxes, but the separation is not their distance.
bool edge_witness(const Boxes& boxes, const Axis& axis, Witness& witness) {
  const Segment a =
      support_edge(boxes.half_a, boxes.R_a, Vector3::Zero(), axis.edge_a, axis.normal);
  const Segment b = support_edge(boxes.half_b, boxes.R_b, boxes.center, axis.edge_b, -axis.normal);
  double s = 0.0;
  double t = 0.0;
  if (!closest_on_lines(a, b, s, t)) return false;
  witness = {a.at(s), b.at(t), axis.normal, axis.distance};
  const double slack = kSameDistance * boxes.scale;
  return std::abs(s) <= a.half_length + slack && std::abs(t) <= b.half_length + slack;
}

}  // namespace

void box_box(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
             const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Boxes boxes{a.size,
                    b.size,
                    X_WA.rotation,
                    X_WB.rotation,
                    X_WB.translation - X_WA.translation,
                    X_WA.rotation.transpose() * X_WB.rotation,
                    a.size.sum() + b.size.sum()};
  Axis axis = best_face(boxes, margin);
  if (axis.distance >= margin) return;
  consider_edges(boxes, margin, axis);
  if (axis.distance >= margin) return;

  const double tolerance = 2.0 * kSameDistance * boxes.scale;
  Feature face_a;
  Feature face_b;
  const auto contacts_along = [&](const Witness& witness) {
    box_feature(a, X_WA, witness.normal, face_a);
    box_feature(b, X_WB, -witness.normal, face_b);
    out.size = 0;
    feature_contacts(face_a, face_b, witness, tolerance, margin, out);
  };
  if (Vector3 normal; axis.edge_a < 0 && axis.distance < query.rounding &&
                      rounded_normal(boxes, axis, query.rounding, normal)) {
    const Segment edge_a = nearest_edge(boxes.half_a, boxes.R_a, Vector3::Zero(), normal);
    const Segment edge_b = nearest_edge(boxes.half_b, boxes.R_b, boxes.center, -normal);
    edge_contacts(edge_a, edge_b, normal, tolerance, margin, out);
    return;
  }
  // The separation along any axis is a lower bound of the distance; if the features reach it, it is
  // the distance.
  Witness witness;
  if (axis.edge_a >= 0) {
    if (edge_witness(boxes, axis, witness) || axis.distance <= 0.0) {
      contacts_along(witness);
      return;
    }
  } else if (axis.distance <= 0.0) {
    const Vector3 lowest = X_WB.translation + farthest_corner(b.size, X_WB.rotation, -axis.normal);
    contacts_along({lowest - axis.distance * axis.normal, lowest, axis.normal, axis.distance});
    return;
  } else {
    contacts_along({Vector3::Zero(), Vector3::Zero(), axis.normal, axis.distance, 0, 0, false});
    if (out.size > 0) return;
  }
  if (closest_points(a, X_WA, b, X_WB, margin, witness)) contacts_along(witness);
}

}  // namespace counterpoint::collision
