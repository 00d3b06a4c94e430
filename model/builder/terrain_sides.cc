// Orientation of terrains: closed meshes that are inside out are flipped; open ones that face away
// from all moving bodies are noted.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

constexpr double kInside = 0.5;  // threshold of a winding number, which is 0 or 1 up to round-off
/// Fraction of the unit sphere below which the solid angle of a surface is round-off or irrelevant.
constexpr double kSeen = 1e-9;
/// Largest number of triangles times points to evaluate; with more, only every second, third ...
/// point is used.
constexpr std::size_t kMostWork = 20'000'000;

/// A set of triangles connected by edges.
struct Part {
  std::vector<int> triangles;
  bool closed = true;
  double volume = 0.0;  ///< volume if closed [m^3]; negative: inside out
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity()), high = -low;
};

std::array<Vector3, 3> corners(const Terrain& terrain, int triangle, const Vector3& from) {
  const auto& v = terrain.triangles[triangle].vertices;
  return {terrain.vertices[v[0]] - from, terrain.vertices[v[1]] - from,
          terrain.vertices[v[2]] - from};
}

std::vector<Part> parts_of(const Terrain& terrain) {
  std::vector<Part> parts;
  std::vector<char> taken(terrain.triangles.size(), 0);
  for (int first = 0; first < static_cast<int>(taken.size()); ++first) {
    if (taken[first]) continue;
    taken[first] = 1;
    Part part;
    part.triangles = {first};
    const Vector3 origin = terrain.vertices[terrain.triangles[first].vertices[0]];
    for (std::size_t i = 0; i < part.triangles.size(); ++i) {
      const int t = part.triangles[i];
      const auto [a, b, c] = corners(terrain, t, origin);
      part.volume += a.dot(b.cross(c)) / 6.0;
      for (const Vector3& corner : {a, b, c}) {
        part.low = part.low.cwiseMin(corner + origin);
        part.high = part.high.cwiseMax(corner + origin);
      }
      for (const int neighbor : terrain.triangles[t].neighbors) {
        if (neighbor < 0) part.closed = false;
        if (neighbor < 0 || taken[neighbor]) continue;
        taken[neighbor] = 1;
        part.triangles.push_back(neighbor);
      }
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

/// Returns the winding number of triangles around p: their solid angle over 4 pi, positive for
/// triangles that show p their back side. It is 1 inside a closed mesh and 0 outside (Van Oosterom
/// and Strackee, 1983).
double winding(const Terrain& terrain, const std::vector<int>& triangles, const Vector3& p) {
  double angle = 0.0;
  for (const int t : triangles) {
    const auto [a, b, c] = corners(terrain, t, p);
    const double x = a.norm(), y = b.norm(), z = c.norm();
    angle +=
        2.0 * std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return angle / (4.0 * std::numbers::pi);
}

/// Returns true if the closed part `outer` encloses `inner`.
bool contains(const Terrain& terrain, const Part& outer, const Part& inner) {
  if (&outer == &inner || (outer.low.array() > inner.low.array()).any() ||
      (outer.high.array() < inner.high.array()).any())
    return false;
  const Vector3& p = terrain.vertices[terrain.triangles[inner.triangles[0]].vertices[0]];
  return std::abs(winding(terrain, outer.triangles, p)) > kInside;
}

/// Returns the closed parts that are inside out, with the parts inside them. Excluded are a part
/// inside another closed part (it bounds a cavity) and a room: an inside-out part that encloses all
/// moving points while no other closed part does.
std::vector<const Part*> inside_out(const Terrain& terrain, const std::vector<Part>& parts,
                                    const std::vector<Vector3>& moving) {
  std::vector<const Part*> closed, turned;
  std::vector<int> all;
  for (const Part& part : parts) {
    if (!part.closed) continue;
    closed.push_back(&part);
    all.insert(all.end(), part.triangles.begin(), part.triangles.end());
  }
  for (const Part* part : closed) {
    if (part->volume >= 0.0) continue;
    if (std::any_of(closed.begin(), closed.end(),
                    [&](const Part* o) { return contains(terrain, *o, *part); }))
      continue;
    const bool is_room =
        !moving.empty() && std::all_of(moving.begin(), moving.end(), [&](const Vector3& p) {
          return winding(terrain, part->triangles, p) < -kInside &&
                 winding(terrain, all, p) < -kInside;
        });
    if (is_room) continue;
    for (const Part* other : closed)
      if (other == part || contains(terrain, *part, *other)) turned.push_back(other);
  }
  return turned;
}

std::shared_ptr<const Terrain> turned(const Terrain& terrain,
                                      const std::vector<const Part*>& parts) {
  TriangleMesh mesh;
  mesh.vertices = terrain.vertices;
  for (const Terrain::Triangle& t : terrain.triangles) mesh.triangles.push_back(t.vertices);
  for (const Part* part : parts)
    for (const int t : part->triangles) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  Terrain out = *make_terrain(mesh, terrain.source);
  out.dropped = terrain.dropped;
  return std::make_shared<const Terrain>(std::move(out));
}

/// Returns true if the open parts show their back side to at least one moving point and their front
/// side to none.
bool looks_away(const Terrain& terrain, const std::vector<Part>& parts,
                const std::vector<Vector3>& moving) {
  std::vector<int> open;
  for (const Part& part : parts)
    if (!part.closed) open.insert(open.end(), part.triangles.begin(), part.triangles.end());
  const std::size_t stride = 1 + open.size() * moving.size() / kMostWork;
  bool back = false;
  for (std::size_t i = 0; i < moving.size(); i += stride) {
    const double seen = winding(terrain, open, moving[i]);
    if (seen < -kSeen) return false;
    back = back || seen > kSeen;
  }
  return back;
}

}  // namespace

void ModelBuilder::orient_terrains() {
  std::vector<Vector3> moving;  // centres of all moving shapes, in W
  const std::vector<Pose> X_WB = body_poses(model_, model_.default_q_);
  for (const Geometry& g : model_.geometries_)
    if (g.body != 0)
      moving.push_back(X_WB[g.body] *
                       (g.X_BG * (g.shape.mesh ? g.shape.mesh->interior_point : Vector3::Zero())));
  for (Geometry& g : model_.geometries_) {
    if (g.shape.type != ShapeType::kTerrain) continue;
    std::vector<Vector3> from;
    for (const Vector3& p : moving) from.push_back(g.X_BG.inverse() * p);
    const std::vector<Part> parts = parts_of(*g.shape.terrain);
    const std::string where = "geometry '" + g.name + "'";
    const auto flipped = inside_out(*g.shape.terrain, parts, from);
    if (!flipped.empty()) {
      double volume = 0.0;
      for (const Part* part : flipped) volume += part->volume;
      model_.notes_.push_back(
          {where,
           fmt::format("a closed mesh that is inside out, of {:.3g} m^3: its faces are turned "
                       "round",
                       volume)});
    }
    if (looks_away(*g.shape.terrain, parts, from))
      model_.notes_.push_back(
          {where,
           "all that moves starts behind its faces and passes through it: triangles push to "
           "the side from which their corners run counter-clockwise only. Turn the faces "
           "round, or start on their other side"});
    if (!flipped.empty()) g.shape.terrain = turned(*g.shape.terrain, flipped);
  }
}

}  // namespace counterpoint
