// Targets for meshes and height fields.
#include <cstdlib>

#include "counterpoint/model/geometry.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {
namespace {

void check_triangles(const TriangleMesh& mesh) {
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

/// Reads a mesh file in both ways that a scene can: as the convex hull of its points, and as
/// terrain.
void read_mesh(const std::filesystem::path& file) {
  const TriangleMesh mesh = load_mesh(file, Vector3(1, 2, -1));
  check_triangles(mesh);
  check_triangles(load_mesh(file, Vector3::Ones(), PolygonSplit::kEars));
  try {
    make_terrain(mesh);
  } catch (const InputError&) {
  }
  load_convex_mesh(file);
}

void check_heights(const HeightGrid& grid) {
  if (grid.heights.size() != static_cast<size_t>(grid.rows) * grid.columns) std::abort();
  make_terrain(height_field_mesh(grid, 2.0, 3.0, 0.5, "heights"));
}

}  // namespace

void read_mesh_dae(std::string_view input) { read_mesh(write("mesh.dae", input)); }
void read_mesh_obj(std::string_view input) { read_mesh(write("mesh.obj", input)); }
void read_mesh_stl(std::string_view input) { read_mesh(write("mesh.stl", input)); }

void read_height_image(std::string_view input) {
  check_heights(load_height_image(write("heights.png", input)));
}
void read_height_table(std::string_view input) {
  check_heights(load_height_table(write("heights.csv", input)));
}

}  // namespace counterpoint::fuzz
