// Contacts on terrain, differentiated as contacts with the element that makes them: a face as a
// plane, an edge as a segment or as the upper side of a thin sheet (terrain_contacts.h).
#include <array>
#include <cmath>

#include "counterpoint/collision/shapes/enclosure.h"
#include "counterpoint/engine/derivatives/constraints/closed_forms.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// A triangle of a terrain, in W.
struct Face {
  std::array<Vector3, 3> corners;
  Vector3 normal;

  Face(const Terrain& terrain, const Pose& X_WT, int triangle)
      : normal(X_WT.rotation * terrain.triangles[triangle].normal) {
    for (int k = 0; k < 3; ++k)
      corners[k] = X_WT * terrain.vertices[terrain.triangles[triangle].vertices[k]];
  }
};

}  // namespace

bool ContactMotionFinder::touch_face(const Pair& pair, const Contact& contact, int triangle,
                                     ContactMotion& out) {
  const bool of_a = pair.a->type == ShapeType::kTerrain;
  const Face face(*(of_a ? pair.a : pair.b)->terrain, of_a ? pair.X_WA : pair.X_WB, triangle);
  const Vector3 n = of_a ? contact.candidate.normal : Vector3(-contact.candidate.normal);
  if ((n - face.normal).norm() > kSamePlace) return false;
  const Vector3 below = contact.middle - 0.5 * contact.candidate.gap * n;
  if (std::abs(n.dot(below - face.corners[0])) > kSamePlace * pair.size) return false;
  const Shape plane{ShapeType::kPlane, Vector3::Zero(), nullptr};
  const Pose X_WP{frame_from_normal(face.normal), face.corners[0]};
  Pair with_plane = pair;
  (of_a ? with_plane.a : with_plane.b) = &plane;
  (of_a ? with_plane.X_WA : with_plane.X_WB) = X_WP;
  return touch(with_plane, contact, false, out);
}

bool ContactMotionFinder::touch_edge(const Pair& pair, const Contact& contact, int triangle,
                                     int edge, ContactMotion& out) {
  const bool of_a = pair.a->type == ShapeType::kTerrain;
  const Terrain& terrain = *(of_a ? pair.a : pair.b)->terrain;
  const Pose& X_WT = of_a ? pair.X_WA : pair.X_WB;
  const Face face(terrain, X_WT, triangle);
  const Vector3 &p = face.corners[edge], &q = face.corners[(edge + 1) % 3];
  const Vector3 n = of_a ? contact.candidate.normal : Vector3(-contact.candidate.normal);
  const Vector3 along = (q - p).normalized(), middle = 0.5 * (p + q);
  const double half = 0.5 * (q - p).norm(), near = kSamePlace * (pair.size + half);
  const Vector3 below = contact.middle - 0.5 * contact.candidate.gap * n - middle;
  const double place = along.dot(below);
  if (std::abs(place) > half + near || (below - place * along).norm() > near) return false;
  const auto touches = [&](const Shape& shape, const Pose& X) {
    Pair with = pair;
    (of_a ? with.a : with.b) = &shape;
    (of_a ? with.X_WA : with.X_WB) = X;
    return touch(with, contact, false, out);
  };
  const Shape segment{ShapeType::kCapsule, Vector3(0.0, half, 0.0), nullptr};
  if (touches(segment, {frame_from_normal(along), middle})) return true;
  const int neighbor = terrain.triangles[triangle].neighbors[edge];
  const Vector3 other = neighbor >= 0 ? Face(terrain, X_WT, neighbor).normal : face.normal;
  const Vector3 up = (face.normal + other).normalized();
  const Shape& solid = of_a ? *pair.b : *pair.a;
  const double depth = 2.0 * collision::enclose(solid).radius;
  const Shape sheet{ShapeType::kBox, Vector3(0.0, depth, half), nullptr};
  Pose X;
  X.rotation << up.cross(along), up, along;
  X.translation = middle - depth * up;
  return touches(sheet, X);
}

bool ContactMotionFinder::touch_terrain(const Pair& pair, const Contact& contact,
                                        ContactMotion& out) {
  const bool of_a = pair.a->type == ShapeType::kTerrain;
  const Terrain& terrain = *(of_a ? pair.a : pair.b)->terrain;
  const Pose X_TW = (of_a ? pair.X_WA : pair.X_WB).inverse();
  // For fast bodies faces may extend beyond their edges, by the displacement of the body.
  const Vector3 middle = X_TW * contact.middle;
  const Vector3 around = Vector3::Constant(4.0 * pair.size + 2.0 * std::abs(contact.candidate.gap));
  for (const double wider : {1.0, 10.0}) {
    triangles_.clear();
    terrain.find(middle - wider * around, middle + wider * around, triangles_);
    for (const int t : triangles_)
      if (touch_face(pair, contact, t, out)) return true;
    for (const int t : triangles_)
      for (int edge = 0; edge < 3; ++edge)
        if (touch_edge(pair, contact, t, edge, out)) return true;
  }
  return false;
}

}  // namespace counterpoint
