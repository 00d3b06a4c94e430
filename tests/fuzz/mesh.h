// Reads a mesh file in both ways that a scene can: as the convex hull of its points, and as
// terrain.
#pragma once

#include "counterpoint/model/geometry.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

inline void check_triangles(const TriangleMesh& mesh) {
  const int size = static_cast<int>(mesh.vertices.size());
  for (const Vector3& v : mesh.vertices) {
    if (!v.allFinite()) std::abort();
  }
  for (const auto& triangle : mesh.triangles) {
    for (const int v : triangle) {
      if (v < 0 || v >= size) std::abort();
    }
  }
}

inline void read_mesh(const std::filesystem::path& file) {
  const TriangleMesh mesh = load_mesh(file, Vector3(1, 2, -1));
  check_triangles(mesh);
  check_triangles(load_mesh(file, Vector3::Ones(), PolygonSplit::kEars));
  try {
    make_terrain(mesh);
  } catch (const InputError&) {
  }
  load_convex_mesh(file);
}

}  // namespace counterpoint::fuzz
