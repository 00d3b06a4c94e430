#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>
#include <tuple>

#include "counterpoint/model/files/module.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/mesh/mesh_reader.h"

namespace counterpoint {
namespace {

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

void check_file(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw InputError(fmt::format("{}: there is no such mesh file", file.string()));
  }
  const std::string extension = lower_extension(file);
  if (extension != ".stl" && extension != ".obj" && extension != ".dae") {
    throw InputError(fmt::format("{}: mesh format '{}' is not known; use .stl, .obj or .dae",
                                 file.string(), extension));
  }
  if (std::filesystem::file_size(file, error) > limits::kMaxMeshBytes) {
    throw InputError(fmt::format("{}: larger than {} MB; simplify the mesh", file.string(),
                                 limits::kMaxMeshBytes / 1'000'000));
  }
}

/// Merges vertices at the same place; removes unused vertices and triangles with repeated ones.
void weld(TriangleMesh& mesh) {
  const auto key = [&](int i) {
    const Vector3& p = mesh.vertices[i];
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::vector<int> order;
  for (const auto& triangle : mesh.triangles) {
    order.insert(order.end(), triangle.begin(), triangle.end());
  }
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto ka = key(a);
    const auto kb = key(b);
    return ka != kb ? ka < kb : a < b;
  });
  order.erase(std::unique(order.begin(), order.end()), order.end());
  // The first vertex of each group of equal ones represents it; the order of the file is kept.
  std::vector<int> representative(mesh.vertices.size(), -1);
  for (size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    representative[order[i]] = same ? representative[order[i - 1]] : order[i];
  }
  std::vector<int> new_index(mesh.vertices.size(), -1);
  std::vector<Vector3> kept;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (representative[i] != static_cast<int>(i)) continue;
    new_index[i] = static_cast<int>(kept.size());
    kept.push_back(mesh.vertices[i]);
  }
  std::vector<std::array<int, 3>> triangles;
  for (auto triangle : mesh.triangles) {
    for (int& v : triangle) v = new_index[representative[v]];
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
      continue;
    }
    triangles.push_back(triangle);
  }
  mesh.vertices = std::move(kept);
  mesh.triangles = std::move(triangles);
}

}  // namespace

TriangleMesh load_mesh(const std::filesystem::path& file, const Vector3& scale,
                       PolygonSplit split) {
  check_file(file);
  if (!scale.allFinite() || (scale.array() == 0.0).any()) {
    throw InputError(fmt::format("{}: mesh scale ({}, {}, {}) must be finite and not zero",
                                 file.string(), scale.x(), scale.y(), scale.z()));
  }
  TriangleMesh mesh = open_module<MeshReader>(Module::kMeshes, file)
                          .read(file, lower_extension(file) == ".dae", split);
  for (Vector3& p : mesh.vertices) {
    p = p.cwiseProduct(scale);
    if (!(p.array().abs() <= limits::kMaxLength).all()) {  // false for NaN, too
      throw InputError(
          fmt::format("{}: a vertex is not a finite number, or farther out than {:g} m",
                      file.string(), limits::kMaxLength));
    }
  }
  if (scale.prod() < 0.0) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  weld(mesh);
  if (mesh.triangles.empty()) {
    throw InputError(fmt::format("{}: the mesh has no triangles", file.string()));
  }
  return mesh;
}

bool is_closed(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) edges.emplace_back(t[k], t[(k + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const std::pair<int, int>& e) {
    return std::binary_search(edges.begin(), edges.end(), std::pair(e.second, e.first));
  });
}

double enclosed_volume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  const Vector3& origin = mesh.vertices[0];  // a point of the mesh: less cancellation
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3 a = mesh.vertices[t[0]] - origin;
    const Vector3 b = mesh.vertices[t[1]] - origin;
    const Vector3 c = mesh.vertices[t[2]] - origin;
    volume += a.dot(b.cross(c)) / 6.0;
  }
  return volume;
}

}  // namespace counterpoint
