#include "counterpoint/model/pieces/solid.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/model/mesh/hull_distance.h"
#include "counterpoint/model/mesh/hull_standoff.h"

namespace counterpoint::pieces {
namespace {

// Relative to the solid's size: points closer together are one.
constexpr double kOnePoint = 1e-9;
// Relative to the tolerance: accuracy of the measured distance.
constexpr double kAccuracy = 0.1;
// Relative to the tolerance: points as near to a plane lie in it, so that the cut along a face
// which is not quite flat leaves no slivers.
constexpr double kFlat = 0.05;
// Sine of the least angle of a concave edge.
constexpr double kFlatEdge = 1e-3;
// Number of points of a hull that are measured at most while cuts are sought.
constexpr int kFewMeasured = 1'500;
// Height over the surface at which hollows are sought, relative to the tolerance.
constexpr double kAbove = 1.05;
// Relative difference of areas and lengths that count as equal.
constexpr double kEqual = 1e-6;

Vector3 face_area(const ConvexMesh& hull, const std::vector<int>& face) {
  Vector3 area = Vector3::Zero();
  for (std::size_t i = 2; i < face.size(); ++i)
    area += (hull.vertices[face[i - 1]] - hull.vertices[face[0]])
                .cross(hull.vertices[face[i]] - hull.vertices[face[0]]);
  return area;
}

/// Axes that turn with the mesh: of equals, the first counts.
Matrix3 axes_of(const ConvexMesh& hull) {
  std::size_t best = 0;
  double largest = 0.0;
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    const double area = face_area(hull, hull.faces[f]).norm();
    if (area <= largest * (1.0 + kEqual)) continue;
    largest = area;
    best = f;
  }
  const std::vector<int>& face = hull.faces[best];
  Vector3 along = Vector3::Zero();
  for (std::size_t i = 0; i < face.size(); ++i) {
    const Vector3 edge = hull.vertices[face[(i + 1) % face.size()]] - hull.vertices[face[i]];
    if (edge.norm() > along.norm() * (1.0 + kEqual)) along = edge;
  }
  Matrix3 axes;
  axes.col(0) = hull.face_normals[best];
  axes.col(2) = axes.col(0).cross(along).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// Returns a point in a hull that is farther from the solid than the tolerance, and above the
/// centroid or the middle of an edge of a triangle; nothing if there is none.
std::optional<Vector3> far_over(const Solid& solid, const ConvexMesh& hull, const Corners3& t) {
  const Vector3 center = (t[0] + t[1] + t[2]) / 3.0;
  solid.work.spend(10);
  double reach = hull.radius;
  for (const Vector3& p : t) reach = std::max(reach, hull.radius + (p - center).norm());
  if ((center - hull.interior_point).norm() > reach + kAbove * solid.tolerance) return {};
  const Vector3 up = kAbove * solid.tolerance * (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  for (const Vector3& place : {center, Vector3(0.5 * (t[0] + t[1])), Vector3(0.5 * (t[1] + t[2])),
                               Vector3(0.5 * (t[2] + t[0]))}) {
    const Vector3 p = place + up;
    solid.work.spend(2 * hull.faces.size());
    if (excess(hull, p) > 0.0) continue;
    if (solid.distance(p) > solid.tolerance) return p;
  }
  return {};
}

/// Returns such a point over the surface of a piece, or over any if the piece is joined from parts:
/// in hollows too narrow to be found from the faces of the hull.
std::optional<Vector3> far_over_surface(const Solid& solid, const Piece& piece) {
  for (const Corners3& t : piece.part.triangles)
    if (const auto far = far_over(solid, *piece.hull, t)) return far;
  if (!piece.part.triangles.empty()) return {};
  const std::vector<Vector3>& v = solid.simple.vertices;
  for (const auto& t : solid.simple.triangles)
    if (const auto far = far_over(solid, *piece.hull, {v[t[0]], v[t[1]], v[t[2]]})) return far;
  return {};
}

}  // namespace

std::vector<ReflexEdge> reflex_edges(const TriangleMesh& mesh) {
  struct Side {
    int low, high, triangle, opposite;
  };
  std::vector<Side> sides;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      const int a = v[k], b = v[(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t), v[(k + 2) % 3]});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  const auto normal = [&](int t) {
    const auto& v = mesh.triangles[t];
    const Vector3& p = mesh.vertices[v[0]];
    return (mesh.vertices[v[1]] - p).cross(mesh.vertices[v[2]] - p).normalized();
  };
  std::vector<ReflexEdge> out;
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    const Side &a = sides[i], &b = sides[i + 1];
    if (a.low != b.low || a.high != b.high) continue;
    const Vector3 &from = mesh.vertices[a.low], &to = mesh.vertices[a.high];
    const Vector3 normal_a = normal(a.triangle), normal_b = normal(b.triangle);
    const bool bends_in = normal_a.dot(mesh.vertices[b.opposite] - from) > 0.0;
    if (bends_in && normal_a.cross(normal_b).norm() > kFlatEdge)
      out.push_back({from, to, normal_a, normal_b});
  }
  return out;
}

Solid::Solid(const TriangleMesh& triangles, const TriangleMesh& simpler, const ConvexMesh& around,
             double tolerance_value)
    : nearest(triangles),
      winding(triangles, nearest, 2.0 * tolerance_value),
      simple(simpler),
      nearest_simple(simple),
      winding_simple(simple, nearest_simple, 2.0 * tolerance_value, &winding),
      reflex(reflex_edges(simple)),
      axes(axes_of(around)),
      size(2.0 * around.radius),
      slack(kOnePoint * size),
      near{std::max(kFlat * tolerance_value, slack), 1e3 * slack},
      tolerance(tolerance_value) {}

double Solid::distance(const Vector3& p) const {
  work.spend(Work::kSearch);
  const double distance = nearest.find(p).distance;
  return distance > tolerance && winding.inside(p) ? 0.0 : distance;
}

Part Solid::whole() const {
  Part out;
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& t : simple.triangles) {
    const Corners3 corners{simple.vertices[t[0]], simple.vertices[t[1]], simple.vertices[t[2]]};
    out.triangles.push_back(corners);
    for (const int v : t) {
      const Vector3 p = axes.transpose() * simple.vertices[v];
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  low.array() -= 0.1 * size;
  high.array() += 0.1 * size;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool up : {false, true}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::vector<Vector3> face;
      for (const auto& [at_u, at_v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        Vector3 p;
        p[axis] = up ? high[axis] : low[axis];
        p[u] = at_u ? high[u] : low[u];
        p[v] = at_v ? high[v] : low[v];
        face.push_back(axes * p);
      }
      if (!up) std::reverse(face.begin(), face.end());
      out.cell.faces.push_back(std::move(face));
    }
  }
  for (std::size_t i = 0; i < reflex.size(); ++i) out.reflex.push_back(static_cast<int>(i));
  return out;
}

std::shared_ptr<const ConvexMesh> hull_of(const std::vector<Vector3>& points,
                                          const std::string& source) {
  try {
    return make_convex_hull(points, source);
  } catch (const InputError&) {  // flat
    return nullptr;
  }
}

void measure_piece(const Solid& solid, Piece& piece) {
  if (const std::optional<Vector3> far = far_over_surface(solid, piece)) {
    piece.error = kAbove * solid.tolerance;
    piece.farthest = *far;
    return;
  }
  const FarthestPoint far =
      outside_of(solid, *piece.hull, solid.tolerance, solid.tolerance, kFewMeasured);
  piece.error = far.distance;
  piece.farthest = far.point;
}

FarthestPoint outside_of(const Solid& solid, const ConvexMesh& hull, double known, double enough,
                         int most) {
  const double accuracy = kAccuracy * solid.tolerance;
  const PartStandoff query{solid.nearest,
                           [&](const Vector3& p, double distance) {
                             solid.work.spend(Work::kSearch);
                             return solid.winding.inside(p) ? distance : -1.0;
                           },
                           accuracy,
                           enough,
                           std::max(known - accuracy, 0.0),
                           most};
  FarthestPoint out = hull_standoff(hull, query);
  if (out.distance <= query.known)
    out.distance = known;  // not as a sum, which rounding could raise above it
  else if (out.distance > accuracy)
    out.distance = std::max(known, out.distance + accuracy);
  return out;
}

}  // namespace counterpoint::pieces
