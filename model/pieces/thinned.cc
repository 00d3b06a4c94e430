#include "counterpoint/model/pieces/thinned.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

constexpr std::size_t kUnthinned = 10'000;
// Number of triangles from which on a mesh is made simpler, and down to which.
constexpr std::size_t kFew = 600, kFewest = 100;
// Number of cells along the longest side of the box, and the ratio of two tries.
constexpr double kFinest = 256.0, kCoarser = 0.75;

/// Number of the cluster of each vertex, in the order of their cells.
std::vector<int> clusters(const std::vector<Vector3>& vertices, const Vector3& low, double cell,
                          int& count) {
  std::vector<std::pair<std::array<int, 3>, int>> cells;
  cells.reserve(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vector3 at = ((vertices[i] - low) / cell).array().floor();
    cells.push_back({{static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z())},
                     static_cast<int>(i)});
  }
  std::sort(cells.begin(), cells.end());
  std::vector<int> out(vertices.size());
  count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0 && cells[i].first != cells[i - 1].first) ++count;
    out[cells[i].second] = count;
  }
  ++count;
  return out;
}

/// Keeps one of equal triangles and none of two that face each other.
void drop_doubles(std::vector<std::array<int, 3>>& triangles) {
  struct Entry {
    std::array<int, 3> sorted;
    std::size_t index;
    bool even;
  };
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::array<int, 3>& t = triangles[i];
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    entries.push_back({{t[0], std::min(t[1], t[2]), std::max(t[1], t[2])}, i, t[1] < t[2]});
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.sorted, a.index) < std::tie(b.sorted, b.index);
  });
  std::vector<char> keep(triangles.size());
  for (std::size_t i = 0; i < entries.size();) {
    int turn = 0;
    std::size_t first[2] = {triangles.size(), triangles.size()};
    const std::array<int, 3> sorted = entries[i].sorted;
    for (; i < entries.size() && entries[i].sorted == sorted; ++i) {
      turn += entries[i].even ? 1 : -1;
      first[entries[i].even] = std::min(first[entries[i].even], entries[i].index);
    }
    if (turn != 0) keep[first[turn > 0]] = 1;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (keep[i]) triangles[kept++] = triangles[i];
  triangles.resize(kept);
}

ThinnedMesh clustered(const TriangleMesh& mesh, const Vector3& low, double cell) {
  ThinnedMesh out;
  int count = 0;
  const std::vector<int> cluster = clusters(mesh.vertices, low, cell, count);
  out.mesh.vertices.assign(count, Vector3::Zero());
  std::vector<int> members(count);
  for (std::size_t i = 0; i < cluster.size(); ++i) {
    out.mesh.vertices[cluster[i]] += mesh.vertices[i];
    ++members[cluster[i]];
  }
  for (int k = 0; k < count; ++k) out.mesh.vertices[k] /= members[k];
  for (std::size_t i = 0; i < cluster.size(); ++i)
    out.moved = std::max(out.moved, (mesh.vertices[i] - out.mesh.vertices[cluster[i]]).norm());
  for (const auto& t : mesh.triangles) {
    const std::array<int, 3> to = {cluster[t[0]], cluster[t[1]], cluster[t[2]]};
    if (to[0] != to[1] && to[1] != to[2] && to[2] != to[0]) out.mesh.triangles.push_back(to);
  }
  drop_doubles(out.mesh.triangles);
  return out;
}

}  // namespace

ThinnedMesh thinned(const TriangleMesh& mesh) {
  if (mesh.triangles.size() <= kUnthinned) return {mesh, 0.0};
  Vector3 low = mesh.vertices[0], high = low;
  for (const Vector3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double size = (high - low).maxCoeff();
  for (double cells = kFinest; cells > 1.0; cells *= kCoarser) {
    ThinnedMesh out = clustered(mesh, low, size / cells);
    if (out.mesh.triangles.size() <= kUnthinned) return out;
  }
  return clustered(mesh, low, 2.0 * size);
}

TriangleMesh simplified(const TriangleMesh& mesh, double error) {
  if (mesh.triangles.size() <= kFew) return mesh;
  std::vector<float> corners;
  for (const Vector3& p : mesh.vertices)
    for (int k = 0; k < 3; ++k) corners.push_back(static_cast<float>(p[k]));
  std::vector<unsigned> from, kept;
  for (const auto& t : mesh.triangles) from.insert(from.end(), t.begin(), t.end());
  kept.resize(from.size());
  const std::size_t count = mesh.vertices.size(), stride = 3 * sizeof(float);
  const float scale = meshopt_simplifyScale(corners.data(), count, stride);
  kept.resize(meshopt_simplify(kept.data(), from.data(), from.size(), corners.data(), count, stride,
                               3 * kFewest, static_cast<float>(error) / scale));
  TriangleMesh out;
  std::vector<int> index(count, -1);
  for (const unsigned v : kept) {
    if (index[v] >= 0) continue;
    index[v] = static_cast<int>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[v]);
  }
  for (std::size_t i = 0; i < kept.size(); i += 3)
    out.triangles.push_back({index[kept[i]], index[kept[i + 1]], index[kept[i + 2]]});
  return out.triangles.empty() || !hull_of(out.vertices, "") ? mesh : out;
}

}  // namespace counterpoint::pieces
