// A half-space against every other shape: the gap of a point is its height above the plane.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "counterpoint/collision/pairs/pair_functions.h"
#include "counterpoint/collision/shapes/core_shape.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

// The plane z = 0 of its frame; the half-space lies below.
struct Plane {
  explicit Plane(const Pose& X) : normal(X.rotation.col(2)), origin(X.translation) {}
  double height(const Vector3& p) const { return normal.dot(p - origin); }
  // Adds the contact of a surface point p of the other shape if its gap is below the margin.
  void add(const Vector3& p, double margin, Manifold& out) const {
    const double gap = height(p);
    if (gap < margin) out.add(p - (0.5 * gap) * normal, normal, gap);
  }
  Vector3 normal, origin;
};

}  // namespace

void plane_sphere(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                  const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Plane plane(X_WA);
  plane.add(X_WB.translation - b.size[0] * plane.normal, margin, out);
}

void plane_capsule(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Plane plane(X_WA);
  const Vector3 half = b.size[1] * X_WB.rotation.col(2);
  const Vector3 low = X_WB.translation - b.size[0] * plane.normal;
  plane.add(low - half, margin, out);
  plane.add(low + half, margin, out);
}

// All eight corners are candidates, not only those of the lowest face, so that nothing jumps when
// the lowest face changes.
void plane_box(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
               const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Plane plane(X_WA);
  const double center = plane.height(X_WB.translation);
  const Vector3 rise = (X_WB.rotation.transpose() * plane.normal).cwiseProduct(b.size);
  if (center - rise.cwiseAbs().sum() >= margin) return;
  for (int i = 0; i < 8; ++i) {
    const Vector3 sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
    const double gap = center + sign.dot(rise);
    if (gap >= margin) continue;
    const Vector3 corner = X_WB.translation + X_WB.rotation * sign.cwiseProduct(b.size);
    out.add(corner - (0.5 * gap) * plane.normal, plane.normal, gap);
  }
}

// Four points per rim: the lowest one and every quarter turn from it. An upright cylinder has no
// lowest point; its square of points starts at its x axis. Since the second moments of a square are
// equal about every axis in its plane, its rotation does not change how it carries load.
void plane_cylinder(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                    const PairQuery& query, Manifold& out) {
  const double margin = query.margin;
  const Plane plane(X_WA);
  const Vector3 axis = X_WB.rotation.col(2);
  Vector3 down = axis * axis.dot(plane.normal) - plane.normal;
  const double length = down.norm();
  // Below round-off of the rotation the direction is noise.
  down = length > 1e-14 ? Vector3(down / length) : Vector3(X_WB.rotation.col(0));
  const Vector3 side = b.size[0] * axis.cross(down);
  down *= b.size[0];
  for (const double end : {-1.0, 1.0}) {
    const Vector3 cap = X_WB.translation + (end * b.size[1]) * axis;
    plane.add(cap + down, margin, out);
    plane.add(cap + side, margin, out);
    plane.add(cap - down, margin, out);
    plane.add(cap - side, margin, out);
  }
}

namespace {

// Heights of a mesh's vertices above a plane.
struct Heights {
  const ConvexMesh& mesh;
  Vector3 up;  // in the frame of the mesh
  double center;

  double of(const Vector3& place) const { return center + up.dot(place); }
  double at(int i) const { return of(mesh.vertices[i]); }
};

constexpr int kMost = Manifold::kCapacity;
using VertexList = std::array<int, kMost>;

// Lists the vertices below the limit, ascending, by walking along edges from the lowest: in a
// convex mesh they are connected. Returns their number, or kMost + 1 if there are more.
int list_below(const Heights& heights, double limit, int lowest, VertexList& list) {
  int size = 0;
  std::uint64_t marks = 0;  // bit set of the last bits of the listed indices
  const auto mark = [](int i) { return std::uint64_t{1} << (i & 63); };
  const auto is_listed = [&](int i) {
    return (marks & mark(i)) != 0 &&
           std::find(list.begin(), list.begin() + size, i) != list.begin() + size;
  };
  const auto add = [&](int i) {
    list[size++] = i;
    marks |= mark(i);
  };
  add(lowest);
  for (int k = 0; k < size; ++k) {
    for (const auto& next : heights.mesh.vertex_neighbors[list[k]]) {
      if (!(heights.of(next.place) < limit) || is_listed(next.vertex)) continue;
      if (size == kMost) return kMost + 1;
      add(next.vertex);
    }
  }
  std::sort(list.begin(), list.begin() + size);
  return size;
}

// Seven directions in the plane, fixed to the mesh.
constexpr int kDirections = kMost - 1;
static_assert(kDirections <= kSupportsAtOnce);
using Directions = std::array<Vector3, kDirections>;

Directions spread_directions(const Vector3& up) {
  const Matrix3 frame = frame_from_normal(up);
  Directions out;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 0.1 + 2.0 * std::numbers::pi / kDirections * k;
    out[k] = std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1);
  }
  return out;
}

// A set of vertices.
struct Choice {
  VertexList vertices;
  int size = 0;

  void add(int i, int most) {
    if (size == most ||
        std::find(vertices.begin(), vertices.begin() + size, i) != vertices.begin() + size) {
      return;
    }
    vertices[size++] = i;
  }
};

// Adds the vertices below the margin that lie farthest along the directions. Only their place
// counts, since heights are noise where a body rests.
void add_farthest(const Heights& heights, int lowest, double margin, const Directions& directions,
                  Choice& choice) {
  std::array<double, kDirections> farthest;
  std::array<int, kDirections> best;
  farthest.fill(-std::numeric_limits<double>::infinity());
  best.fill(lowest);
  const std::vector<Vector3>& vertices = heights.mesh.vertices;
  for (int i = 0; i < static_cast<int>(vertices.size()); ++i) {
    if (!(heights.at(i) < margin)) continue;
    for (int k = 0; k < kDirections; ++k) {
      const double along = directions[k].dot(vertices[i]);
      if (along <= farthest[k]) continue;
      farthest[k] = along;
      best[k] = i;
    }
  }
  for (const int i : best) choice.add(i, kDirections);
}

// True if a vertex stays the lowest when the mesh tips by up to `angle` [rad]: each edge from it
// rises by more. This is typical of a foot with many vertices.
bool stays_lowest(const Heights& heights, int lowest, double angle) {
  const Vector3& from = heights.mesh.vertices[lowest];
  bool stays = true;
  for (const auto& next : heights.mesh.vertex_neighbors[lowest]) {
    const Vector3 edge = next.place - from;
    const double rise = heights.up.dot(edge);
    stays &= rise > 0.0 && rise * rise > angle * angle * edge.squaredNorm();
  }
  return stays;
}

// Adds the vertices that would be the lowest if the mesh tipped along each direction, by a small
// share of the angle and by all of it, until the choice is full.
void add_tipped(const Heights& heights, int lowest, double angle, const Directions& directions,
                Choice& choice) {
  constexpr double kLittle = 1.0 / 16.0;  // share of the angle
  const auto down = [&](double share, int k) -> Vector3 {
    return (share * angle) * directions[k] - heights.up;
  };
  Directions little;
  for (int k = 0; k < kDirections; ++k) little[k] = down(kLittle, k);
  std::array<int, kDirections> tipped;
  support_vertices(heights.mesh, little, lowest, tipped);
  for (const int i : tipped) choice.add(i, kDirections);
  for (int k = 0; k < kDirections && choice.size < kDirections; ++k)
    choice.add(support_vertex(heights.mesh, down(1.0, k), tipped[k]), kDirections);
}

// Chooses among the vertices below the margin. If there are too many: the lowest, and those on
// which the mesh would stand after a rotation by `turn`, or by a small share of it. On a face these
// are its outer corners, on a dense round mesh one or two vertices.
Choice choose_vertices(const Heights& heights, int lowest, double margin, double turn) {
  Choice choice;
  if (stays_lowest(heights, lowest, turn)) {
    choice.add(lowest, kMost);
    return choice;
  }
  choice.size = list_below(heights, margin, lowest, choice.vertices);
  if (choice.size <= kMost) return choice;
  choice.size = 0;
  const Directions directions = spread_directions(heights.up);
  if (turn < std::numeric_limits<double>::infinity()) {
    add_tipped(heights, lowest, turn, directions, choice);
  } else {
    add_farthest(heights, lowest, margin, directions, choice);
  }
  choice.add(lowest, kMost);  // last, since on a resting body noise decides which is the lowest
  return choice;
}

}  // namespace

void plane_convex_mesh(const Shape&, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                       const PairQuery& query, Manifold& out) {
  const Plane plane(X_WA);
  const Heights heights{*b.mesh, X_WB.rotation.transpose() * plane.normal,
                        plane.height(X_WB.translation)};
  const int lowest = support_vertex(*b.mesh, -heights.up, likely_vertex(*b.mesh, -heights.up));
  if (!(heights.at(lowest) < query.margin)) return;
  const Choice choice = choose_vertices(heights, lowest, query.margin, query.turn);
  for (int i = 0; i < choice.size; ++i)
    plane.add(X_WB * b.mesh->vertices[choice.vertices[i]], query.margin, out);
}

}  // namespace counterpoint::collision
