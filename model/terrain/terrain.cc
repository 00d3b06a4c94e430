#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"

namespace counterpoint {
namespace {

// Edges with a smaller bend [rad] count as flat: a ball that rolls over one leaves one face and
// meets the other within this angle times its radius.
constexpr double kFlatAngle = 1e-4;
// Triangles lower than this share of their longest side have no usable normal.
constexpr double kLeastHeight = 1e-10;

Vector3 area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vector3& p = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - p).cross(mesh.vertices[t[2]] - p);
}

// Rotates the indices so that the lowest leads; equal triangles then compare equal.
std::array<int, 3> canonical(std::array<int, 3> t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

void take_triangles(const TriangleMesh& mesh, Terrain& out) {
  std::vector<std::pair<std::array<int, 3>, int>> seen;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    seen.emplace_back(canonical(mesh.triangles[i]), static_cast<int>(i));
  }
  std::sort(seen.begin(), seen.end());
  std::vector<char> again(mesh.triangles.size(), 0);
  for (size_t i = 1; i < seen.size(); ++i)
    again[seen[i].second] = seen[i].first == seen[i - 1].first;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::array<int, 3>& t = mesh.triangles[i];
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) {
      longest = std::max(longest, (mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]).norm());
    }
    const Vector3 area = area_vector(mesh, t);
    const double size = area.norm();
    if (again[i] || !(size > kLeastHeight * longest * longest)) {
      ++out.dropped;
      continue;
    }
    Terrain::Triangle triangle;
    triangle.vertices = t;
    triangle.normal = area / size;
    triangle.neighbors = {-1, -1, -1};
    triangle.edges = {Terrain::Edge::kRim, Terrain::Edge::kRim, Terrain::Edge::kRim};
    out.triangles.push_back(triangle);
  }
}

struct HalfEdge {
  int from, to, triangle, side;
  bool operator<(const HalfEdge& o) const {
    return std::tie(from, to, triangle) < std::tie(o.from, o.to, o.triangle);
  }
};

// Angle between triangle t and its neighbour u across the edge `side` of t [rad]; positive if the
// edge is convex towards the bodies.
double bend(const Terrain& terrain, int t, int side, int u) {
  const Terrain::Triangle& a = terrain.triangles[t];
  const Vector3& p = terrain.vertices[a.vertices[side]];
  const Vector3 edge = (terrain.vertices[a.vertices[(side + 1) % 3]] - p).normalized();
  const Vector3& n = a.normal;
  const Vector3& m = terrain.triangles[u].normal;
  return std::atan2(n.cross(m).dot(edge), n.dot(m));
}

void connect(Terrain& out) {
  std::vector<HalfEdge> edges;
  for (size_t t = 0; t < out.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto& v = out.triangles[t].vertices;
      edges.push_back({v[k], v[(k + 1) % 3], static_cast<int>(t), k});
    }
  }
  std::sort(edges.begin(), edges.end());
  const auto range = [&](int from, int to) {
    return std::equal_range(edges.begin(), edges.end(), HalfEdge{from, to, 0, 0},
                            [](const HalfEdge& a, const HalfEdge& b) {
                              return std::tie(a.from, a.to) < std::tie(b.from, b.to);
                            });
  };
  for (const HalfEdge& e : edges) {
    const auto [same_begin, same_end] = range(e.from, e.to);
    const auto [begin, end] = range(e.to, e.from);
    if (same_end - same_begin > 1 || end - begin > 1) ++out.misfits;
    Terrain::Triangle& triangle = out.triangles[e.triangle];
    // Sheets with faces on both sides share an edge four times: the flattest neighbour continues
    // the surface.
    double flattest = std::numeric_limits<double>::infinity();
    for (auto it = begin; it != end; ++it) {
      const double angle = bend(out, e.triangle, e.side, it->triangle);
      if (!(std::abs(angle) < std::abs(flattest))) continue;
      flattest = angle;
      triangle.neighbors[e.side] = it->triangle;
    }
    if (triangle.neighbors[e.side] < 0) continue;
    triangle.edges[e.side] = flattest > kFlatAngle    ? Terrain::Edge::kConvex
                             : flattest < -kFlatAngle ? Terrain::Edge::kConcave
                                                      : Terrain::Edge::kFlat;
  }
  out.vertex_neighbors.resize(out.vertices.size());
  for (const HalfEdge& e : edges) {
    out.vertex_neighbors[e.from].push_back(e.to);
    out.vertex_neighbors[e.to].push_back(e.from);
  }
  for (std::vector<int>& list : out.vertex_neighbors) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

}  // namespace

void Terrain::find(const Vector3& box_low, const Vector3& box_high, std::vector<int>& out) const {
  const std::size_t before = out.size();
  std::array<int, 64> stack;
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const int index = stack[--size];
    const TriangleTree::Node& node = tree.nodes[index];
    if ((node.low.array() > box_high.array()).any() || (node.high.array() < box_low.array()).any())
      continue;
    if (node.count > 0) {
      const auto first = tree.order.begin() + node.first;
      out.insert(out.end(), first, first + node.count);
      continue;
    }
    stack[size++] = node.right;
    stack[size++] = index + 1;
  }
  const auto misses = [&](int t) {
    for (int i = 0; i < 3; ++i) {
      const auto& v = triangles[t].vertices;
      const double a = vertices[v[0]][i], b = vertices[v[1]][i], c = vertices[v[2]][i];
      if (std::min({a, b, c}) > box_high[i] || std::max({a, b, c}) < box_low[i]) return true;
    }
    return false;
  };
  out.erase(std::remove_if(out.begin() + static_cast<std::ptrdiff_t>(before), out.end(), misses),
            out.end());
  std::sort(out.begin() + static_cast<std::ptrdiff_t>(before), out.end());
}

std::shared_ptr<const Terrain> make_terrain(const TriangleMesh& mesh, const std::string& source) {
  const std::string at = source.empty() ? "terrain" : source;
  const int size = static_cast<int>(mesh.vertices.size());
  for (int i = 0; i < size; ++i) {
    if ((mesh.vertices[i].array().abs() <= limits::kMaxLength).all()) continue;  // false for NaN
    throw InputError(fmt::format("{}: vertex {} is not a finite number, or farther out than {:g} m",
                                 at, i, limits::kMaxLength));
  }
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const int v : mesh.triangles[i]) {
      if (v >= 0 && v < size) continue;
      throw InputError(
          fmt::format("{}: triangle {} names vertex {}; there are {}", at, i, v, size));
    }
  }
  auto out = std::make_shared<Terrain>();
  out->vertices = mesh.vertices;
  out->source = source;
  take_triangles(mesh, *out);
  if (out->triangles.empty()) {
    throw InputError(at + ": no triangle has an area; a terrain needs at least one");
  }
  connect(*out);
  std::vector<std::array<int, 3>> corners;
  for (const Terrain::Triangle& triangle : out->triangles) corners.push_back(triangle.vertices);
  out->tree = TriangleTree(out->vertices, corners);
  out->low = out->tree.nodes[0].low;
  out->high = out->tree.nodes[0].high;
  return out;
}

}  // namespace counterpoint
