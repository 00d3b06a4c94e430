#include "counterpoint/collision/pairs/terrain_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/rays/ray.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

// Relative to the shape's size: contacts closer together than this, whose normals agree as well,
// are one.
constexpr double kSameContact = 1e-3;
// Relative to the shape's size: twice the largest angle [rad] of edges that count as flat.
constexpr double kFlatSlack = 2e-4;
// Relative to the shape's half thickness: largest distance of the shape's centre behind a face.
constexpr double kBehind = 0.5;
// The same for an edge inside the shape.
constexpr double kPast = 1.5;
// Relative to the shape's half thickness: overlap up to which a contact needs no further test.
constexpr double kShallow = 0.05;
// Relative to the depth of a corner: how far beyond the flat edges of a face the path to the corner
// may cross the plane of the face.
constexpr double kSlant = 3.0;
// A normal is within the wedge of an edge if its cosine with the inward directions in both faces is
// at most this.
constexpr double kWedge = 1e-6;
// Cosine: a contact with the rim of a sheet leans at most 60 degrees, since a rim has no side to
// push with.
constexpr double kRimCosine = 0.5;

// Signed distance of a point from edge pq in the plane of the triangle: positive on the triangle's
// side.
double inward(const Vector3& p, const Vector3& q, const Vector3& normal, const Vector3& point) {
  return normal.cross(q - p).normalized().dot(point - p);
}

// Distance of a point from the edges of a triangle, along its plane.
double distance_in_plane(const std::array<Vector3, 3>& corners, const Vector3& normal,
                         const Vector3& point) {
  const Vector3 p = point - normal.dot(point - corners[0]) * normal;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3 edge = corners[(k + 1) % 3] - corners[k];
    const double along = std::clamp(edge.dot(p - corners[k]) / edge.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (corners[k] + along * edge - p).norm());
  }
  return least;
}

}  // namespace

struct TerrainContacts::Query {
  const Terrain& terrain;
  const Shape& shape;
  Pose X_TS;
  Vector3 center;    // centre of the shape, in the terrain's frame [m]
  double thickness;  // half thickness of the shape [m]
  double size;       // diameter of the shape's bounding ball [m]
  double margin;

  const Vector3& vertex(int t, int k) const {
    return terrain.vertices[terrain.triangles[t].vertices[k % 3]];
  }
  // True for points over a triangle, or beyond its edges by at most `slack`, plus `level_slack` at
  // flat edges. Beyond a concave edge the face continues below its neighbour, so that a fast body
  // meets a face that stands across its path; `continued`, if given, is set there.
  bool is_over(int t, const Vector3& p, double slack, double level_slack,
               bool* continued = nullptr) const {
    const Terrain::Triangle& triangle = terrain.triangles[t];
    const Vector3& n = triangle.normal;
    double reach = 0.0;  // largest slack beyond an edge that the point passes
    for (int k = 0; k < 3; ++k) {
      double beyond = slack;
      // Avoids a gap between two faces that are not quite in one plane.
      if (triangle.edges[k] == Terrain::Edge::kFlat) beyond += level_slack;
      const double inside = inward(vertex(t, k), vertex(t, k + 1), n, p);
      if (inside < -beyond) {
        if (triangle.edges[k] != Terrain::Edge::kConcave || !std::isfinite(margin)) return false;
        beyond += margin;
        if (inside < -beyond) return false;
        if (continued) *continued = true;
      }
      if (inside < 0.0) reach = std::max(reach, beyond);
    }
    // Near a sharp corner of the triangle points far from it are near the lines of its edges.
    return reach == 0.0 ||
           distance_in_plane({vertex(t, 0), vertex(t, 1), vertex(t, 2)}, n, p) <= reach;
  }
  // True if a point is inside the solid, or under the ground, seen along n. The ray leans, lest it
  // pass through an edge or corner that touches, where no side is defined.
  bool covers(const Vector3& p, const Vector3& n) const {
    return is_behind(terrain, p, (n + Vector3(0.0103, 0.0071, 0.0047)).normalized(), size);
  }
};

void TerrainContacts::add(const Query& query, const ContactPoint& point) {
  if (point.gap < -kShallow * query.thickness) {
    // A point of the shape below the face may be outside the solid, beyond its other side.
    if (!query.covers(point.position + 0.5 * point.gap * point.normal, point.normal)) return;
  }
  for (ContactPoint& known : points_) {
    const double same = kSameContact * query.size;
    if ((known.position - point.position).squaredNorm() > same * same ||
        known.normal.dot(point.normal) < 1.0 - 0.5 * kSameContact * kSameContact) {
      continue;
    }
    if (point.gap < known.gap) known = point;
    return;
  }
  points_.push_back(point);
}

// Adds the contacts of the shape's corners (for round shapes the lowest points) with a face.
void TerrainContacts::touch_faces(const Query& query, int t) {
  const Terrain::Triangle& triangle = query.terrain.triangles[t];
  const Vector3& n = triangle.normal;
  const Vector3& origin = query.vertex(t, 0);
  const double height = n.dot(query.center - origin);
  const bool behind = height < -kBehind * query.thickness;
  const double rounding = 1e-9 * query.size;
  const auto take = [&](const ContactPoint& point) {
    const Vector3 corner = point.position + 0.5 * point.gap * n;
    bool continued = false;
    const bool over = query.is_over(t, corner, rounding, kFlatSlack * query.size, &continued);
    // The point where the path from the shape's centre to the corner crosses the face's plane.
    const auto crossing = [&]() -> Vector3 {
      return query.center + height / (height - point.gap) * (corner - query.center);
    };
    if (point.gap >= -kShallow * query.thickness) {
      // The face continues within the solid, not in the open beside its neighbour, unless the shape
      // may move past that within the step.
      if (over && continued && (query.margin < query.size || point.gap < 0.0) &&
          !query.covers(corner - (std::max(point.gap, 0.0) + rounding) * n, n))
        return;
      // A shape behind the face: a corner that came through the face is ignored, one that reaches
      // over it from beyond its edges rests on it.
      if (over && !(behind && query.is_over(t, crossing(), 0.0, 0.0))) add(query, point);
      return;
    }
    if (behind || (!over && height <= 0.0)) return;
    // Well below the face: the path to the corner must lead through the face, or nearly if the
    // corner is below it; otherwise the far side of a thin wall would hold a body that reaches over
    // the wall.
    const double slack = over ? kShallow * query.thickness : rounding;
    const double level_slack = over ? -kSlant * point.gap : kFlatSlack * query.size;
    if (!query.is_over(t, crossing(), slack, level_slack)) return;
    add(query, point);
  };
  if (query.shape.type == ShapeType::kConvexMesh) {
    for (const Vector3& v : query.shape.mesh->vertices) {
      const Vector3 p = query.X_TS * v;
      const double gap = n.dot(p - origin);
      if (gap < query.margin) take({p - (0.5 * gap) * n, n, gap});
    }
    return;
  }
  const Shape plane{ShapeType::kPlane, Vector3::Zero(), nullptr};
  Manifold manifold;
  pair_contacts(plane, {frame_from_normal(n), origin}, query.shape, query.X_TS, query.margin,
                manifold);
  for (int i = 0; i < manifold.size; ++i) take(manifold.points[i]);
}

// Treats an edge as the upper rim of a sheet that reaches deep into the ground: the way out is up.
void TerrainContacts::touch_fin(const Query& query, const Vector3& middle, const Vector3& along,
                                double half_length, const Vector3& up) {
  if (up.dot(query.center - middle) < -kPast * query.thickness) return;
  const Shape fin{ShapeType::kBox, Vector3(0.0, query.size, half_length), nullptr};
  Pose X_TF;
  X_TF.rotation << up.cross(along), up, along;
  X_TF.translation = middle - query.size * up;
  Manifold manifold;
  pair_contacts(fin, X_TF, query.shape, query.X_TS, 0.0, manifold);
  for (int i = 0; i < manifold.size; ++i)
    if (manifold.points[i].normal.dot(up) > kRimCosine) add(query, manifold.points[i]);
}

// Adds the contacts of the shape with the triangle's convex and boundary edges, taken as segments.
void TerrainContacts::touch_edges(const Query& query, int t) {
  const Terrain::Triangle& triangle = query.terrain.triangles[t];
  for (int k = 0; k < 3; ++k) {
    const int neighbor = triangle.neighbors[k];
    if (triangle.edges[k] == Terrain::Edge::kFlat || triangle.edges[k] == Terrain::Edge::kConcave) {
      continue;
    }
    if (neighbor >= 0 && neighbor < t) continue;  // done for the other triangle
    const Vector3& p = query.vertex(t, k);
    const Vector3& q = query.vertex(t, k + 1);
    const Vector3 along = (q - p).normalized();
    const double half_length = 0.5 * (q - p).norm();
    const Vector3 middle = 0.5 * (p + q);
    const Shape segment{ShapeType::kCapsule, Vector3(0.0, half_length, 0.0), nullptr};
    Manifold manifold;
    pair_contacts(segment, {frame_from_normal(along), middle}, query.shape, query.X_TS,
                  query.margin, manifold);
    const Vector3& other_normal =
        neighbor >= 0 ? query.terrain.triangles[neighbor].normal : triangle.normal;
    const Vector3 up = (triangle.normal + other_normal).normalized();
    bool fin = false;
    for (int i = 0; i < manifold.size; ++i) {
      const ContactPoint& point = manifold.points[i];
      const Vector3& m = point.normal;
      if (point.gap < 0.0 && m.dot(up) < 0.0) {
        // The edge is past the middle of a thin shape; the shortest way out would push it through.
        fin = true;
        break;
      }
      if (neighbor < 0 && m.dot(triangle.normal) < kRimCosine) continue;
      const double place = along.dot(point.position - 0.5 * point.gap * m - middle);
      if (std::abs(place) > (1.0 - 1e-9) * half_length) {
        // At an end of the edge: the normal must point away from all edges that meet there.
        const int end = triangle.vertices[place < 0.0 ? k : (k + 1) % 3];
        const Vector3& corner = query.terrain.vertices[end];
        const auto& others = query.terrain.vertex_neighbors[end];
        const bool closer = std::any_of(others.begin(), others.end(), [&](int other) {
          return m.dot((query.terrain.vertices[other] - corner).normalized()) > kWedge;
        });
        if (closer) continue;
      } else {
        // Within the wedge: the normal must point away from both faces, else one of them is closer.
        if (m.dot(triangle.normal.cross(along)) > kWedge ||
            (neighbor >= 0 && m.dot(along.cross(other_normal)) > kWedge)) {
          fin = fin || point.gap < -kShallow * query.thickness;
          // The shape may turn onto the edge, and past it, before the next search.
          const bool ahead = point.gap > 0.0 && query.margin > query.thickness &&
                             std::isfinite(query.margin) && m.dot(up) > kRimCosine;
          if (!ahead) continue;
        }
      }
      add(query, point);
    }
    if (fin) touch_fin(query, middle, along, half_length, up);
  }
}

// Chooses the deepest contact, then repeatedly the one farthest, in position and normal, from the
// chosen ones.
void TerrainContacts::choose(const Query& query, Manifold& out) const {
  const int size = static_cast<int>(points_.size());
  if (size <= Manifold::kCapacity) {
    for (const ContactPoint& p : points_) out.add(p.position, p.normal, p.gap);
    return;
  }
  int next = 0;
  for (int i = 1; i < size; ++i) {
    if (points_[i].gap < points_[next].gap) next = i;
  }
  std::array<int, Manifold::kCapacity> chosen{};
  for (int n = 0; n < Manifold::kCapacity; ++n) {
    chosen[n] = next;
    double farthest = -1.0;
    for (int i = 0; i < size; ++i) {
      double distance2 = std::numeric_limits<double>::infinity();
      for (int k = 0; k <= n; ++k) {
        const ContactPoint& c = points_[chosen[k]];
        distance2 = std::min(
            distance2, (points_[i].position - c.position).squaredNorm() +
                           query.size * query.size * (points_[i].normal - c.normal).squaredNorm());
      }
      if (distance2 > farthest) {
        farthest = distance2;
        next = i;
      }
    }
  }
  std::sort(chosen.begin(), chosen.end());
  for (const int i : chosen) out.add(points_[i].position, points_[i].normal, points_[i].gap);
}

void TerrainContacts::find(const Terrain& terrain, const Pose& X_WT, const Shape& shape,
                           const Enclosure& enclosure, const Pose& X_WS, double margin,
                           Manifold& out) {
  out.size = 0;
  const Pose X_TS = X_WT.inverse() * X_WS;
  const Query query{
      terrain, shape, X_TS, X_TS * enclosure.center, enclosure.thickness, 2.0 * enclosure.radius,
      margin};
  const Vector3 reach =
      (X_TS.rotation.cwiseAbs() * enclosure.half).cwiseMin(enclosure.radius).array() + margin;
  triangles_.clear();
  points_.clear();
  terrain.find(query.center - reach, query.center + reach, triangles_);
  for (const int t : triangles_) touch_faces(query, t);
  for (const int t : triangles_) touch_edges(query, t);
  choose(query, out);
  for (int i = 0; i < out.size; ++i) {
    out.points[i].position = X_WT * out.points[i].position;
    out.points[i].normal = X_WT.rotation * out.points[i].normal;
  }
}

}  // namespace counterpoint::collision
