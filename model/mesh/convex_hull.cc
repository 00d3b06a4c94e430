// make_convex_hull: calls qhull (reentrant version).
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <optional>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace counterpoint {
namespace {

// Facets whose planes agree within this share of the size are merged to one polygon: above the
// noise of single precision (6e-8), far below any relevant feature.
constexpr double kCoplanarTolerance = 3e-7;
// A hull with less volume, relative to the cube of its size, is flat and refused.
constexpr double kLeastVolume = 1e-12;

struct Facets {
  std::vector<std::vector<int>> polygons;  // indices of points
  std::string error;                       // message of qhull if it failed
};

Facets run_qhull(std::vector<double>& coordinates, const std::string& options) {
  Facets result;
  char* text = nullptr;
  size_t text_size = 0;
  FILE* messages = open_memstream(&text, &text_size);
  if (messages == nullptr) throw std::bad_alloc();
  qhT qhull;
  qhT* qh = &qhull;
  qh_zero(qh, messages);
  std::string command = options;
  const int code = qh_new_qhull(qh, 3, static_cast<int>(coordinates.size() / 3), coordinates.data(),
                                False, command.data(), nullptr, messages);
  if (code == 0) {
    facetT* facet = nullptr;
    FORALLfacets {
      setT* ring = qh_facet3vertex(qh, facet);
      std::vector<int>& polygon = result.polygons.emplace_back();
      vertexT* vertex;    // NOLINT: set by the macro
      vertexT** vertexp;  // NOLINT: set by the macro
      FOREACHvertex_(ring) { polygon.push_back(qh_pointid(qh, vertex->point)); }
      qh_settempfree(qh, &ring);
    }
  }
  qh_freeqhull(qh, !qh_ALL);
  int long_blocks = 0;
  int long_bytes = 0;
  qh_memfreeshort(qh, &long_blocks, &long_bytes);
  std::fclose(messages);
  if (code != 0) result.error = text_size > 0 ? std::string(text) : "unknown failure";
  std::free(text);
  return result;
}

/// Area vector, twice the area times the unit normal, as a sum over a fan of triangles (Newell):
/// valid for polygons that are not quite planar.
Vector3 polygon_normal(const std::vector<Vector3>& points, const std::vector<int>& polygon) {
  Vector3 normal = Vector3::Zero();
  const Vector3& origin = points[polygon[0]];
  for (size_t i = 1; i + 1 < polygon.size(); ++i) {
    normal += (points[polygon[i]] - origin).cross(points[polygon[i + 1]] - origin);
  }
  return normal;
}

/// Coordinates relative to `origin`, an array per axis; the last point pads to a multiple of 8.
std::array<std::vector<double>, 3> columns(const std::vector<Vector3>& points,
                                           const Vector3& origin) {
  constexpr size_t kTogether = 8;
  const size_t size = (points.size() + kTogether - 1) / kTogether * kTogether;
  std::array<std::vector<double>, 3> out;
  for (size_t i = 0; i < size; ++i) {
    const Vector3 p = points[std::min(i, points.size() - 1)] - origin;
    for (int k = 0; k < 3; ++k) out[k].push_back(p[k]);
  }
  return out;
}

/// Computes normals, offsets, the volume, and the faces at each vertex. False if a face is not
/// planar or faces inwards.
bool add_planes(ConvexMesh& hull, double size) {
  hull.vertex_faces.resize(hull.vertices.size());
  for (const auto& face : hull.faces) {
    for (const int v : face) {
      hull.vertex_faces[v].push_back(static_cast<int>(hull.face_normals.size()));
    }
    const Vector3 area = polygon_normal(hull.vertices, face);
    if (!(area.norm() > 0.0)) return false;
    const Vector3 normal = area.normalized();
    double offset = 0.0;
    for (const int v : face) offset += normal.dot(hull.vertices[v]);
    offset /= static_cast<double>(face.size());
    for (const int v : face) {
      if (std::abs(normal.dot(hull.vertices[v]) - offset) > 20.0 * kCoplanarTolerance * size) {
        return false;
      }
    }
    if (!(offset > normal.dot(hull.interior_point))) return false;
    hull.volume += area.dot(hull.vertices[face[0]] - hull.interior_point) / 6.0;
    hull.face_normals.push_back(normal);
    hull.face_offsets.push_back(offset);
  }
  return true;
}

/// The hull from qhull's facets; nothing if they do not form a closed convex polyhedron.
std::optional<ConvexMesh> assemble(const std::vector<Vector3>& points, const Facets& facets,
                                   double size) {
  ConvexMesh hull;
  std::vector<int> index(points.size(), -1);
  for (const auto& polygon : facets.polygons) {
    for (const int p : polygon) index[p] = 0;
  }
  for (size_t i = 0; i < points.size(); ++i) {
    if (index[i] < 0) continue;
    index[i] = static_cast<int>(hull.vertices.size());
    hull.vertices.push_back(points[i]);
  }
  if (hull.vertices.size() < 4) return std::nullopt;
  for (const Vector3& v : hull.vertices) hull.interior_point += v;
  hull.interior_point /= static_cast<double>(hull.vertices.size());
  for (const Vector3& v : hull.vertices) {
    hull.radius = std::max(hull.radius, (v - hull.interior_point).norm());
  }

  std::vector<std::pair<int, int>> edges;
  for (const auto& polygon : facets.polygons) {
    if (polygon.size() < 3) return std::nullopt;
    std::vector<int> face;
    for (const int p : polygon) face.push_back(index[p]);
    if (polygon_normal(hull.vertices, face).dot(hull.vertices[face[0]] - hull.interior_point) < 0) {
      std::reverse(face.begin(), face.end());
    }
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    for (size_t i = 0; i < face.size(); ++i)
      edges.emplace_back(face[i], face[(i + 1) % face.size()]);
    hull.faces.push_back(std::move(face));
  }
  std::sort(hull.faces.begin(), hull.faces.end());
  // In a closed surface every directed edge occurs once, and so does its reverse.
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return std::nullopt;
  VertexNeighbors& neighbors = hull.vertex_neighbors;
  neighbors.begin.assign(hull.vertices.size() + 1, 0);
  for (const auto& [a, b] : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), std::pair(b, a))) return std::nullopt;
    neighbors.all.push_back({hull.vertices[b], b});
    ++neighbors.begin[a + 1];
  }
  std::partial_sum(neighbors.begin.begin(), neighbors.begin.end(), neighbors.begin.begin());
  if (!add_planes(hull, size)) return std::nullopt;
  hull.vertex_columns = columns(hull.vertices, hull.interior_point);
  hull.normal_columns = columns(hull.face_normals, Vector3::Zero());
  return hull;
}

}  // namespace

std::shared_ptr<const ConvexMesh> make_convex_hull(const std::vector<Vector3>& points,
                                                   const std::string& source) {
  const std::string at = source.empty() ? "convex hull" : source;
  const auto refuse = [&](const std::string& why) {
    throw InputError(
        fmt::format("{}: {}; a collision mesh must be solid: use a thin box for a plate", at, why));
  };
  if (points.size() < 4) refuse(fmt::format("{} points span no volume", points.size()));
  Vector3 low = points[0];
  Vector3 high = points[0];
  for (const Vector3& p : points) {
    if (!p.allFinite()) throw InputError(at + ": a vertex is not a finite number");
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double size = (high - low).norm();
  if (!(size >= limits::kMinLength)) refuse("all its points are the same, or nearly so");
  // Centred and scaled to unit size, so that qhull's tolerances mean the same for every mesh.
  const Vector3 middle = 0.5 * (low + high);
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vector3& p : points) {
    for (int i = 0; i < 3; ++i) coordinates.push_back((p[i] - middle[i]) / size);
  }
  std::string error;
  // First with merged polygons; if these do not form a valid polyhedron, with triangles.
  for (const std::string& options :
       {fmt::format("qhull Pp C-0 C{}", kCoplanarTolerance), std::string("qhull Pp Qt")}) {
    const Facets facets = run_qhull(coordinates, options);
    error = facets.error;
    if (!error.empty()) continue;
    std::optional<ConvexMesh> hull = assemble(points, facets, size);
    if (!hull) continue;
    if (hull->volume < kLeastVolume * size * size * size) break;
    hull->source = source;
    return std::make_shared<const ConvexMesh>(std::move(*hull));
  }
  refuse("its points are flat or nearly so, and span no volume");
  return nullptr;
}

}  // namespace counterpoint
