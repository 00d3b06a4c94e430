// Targets for meshes and height fields.
#include <cmath>
#include <cstdlib>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/pieces/pieces.h"
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

/// Aborts unless the pieces are solid, no more than asked for, and their distances numbers.
void check_pieces(const Pieces& found, int most) {
  if (found.pieces.empty() || found.pieces.size() > static_cast<size_t>(most)) std::abort();
  for (const auto& piece : found.pieces) {
    if (piece->vertices.size() < 4 || !(piece->volume > 0.0) || !std::isfinite(piece->volume))
      std::abort();
    for (const Vector3& v : piece->vertices) {
      if (!v.allFinite()) std::abort();
    }
  }
  for (const double length : {found.tolerance, found.outside, found.inside}) {
    if (!(length >= 0.0) || !std::isfinite(length)) std::abort();
  }
}

void check_heights(const HeightGrid& grid) {
  if (grid.heights.size() != static_cast<size_t>(grid.rows) * grid.columns) std::abort();
  make_terrain(height_field_mesh(grid, 2.0, 3.0, 0.5, "heights"));
}

}  // namespace

void read_mesh_dae(std::string_view input) { read_mesh(write("mesh.dae", input)); }
void read_mesh_obj(std::string_view input) { read_mesh(write("mesh.obj", input)); }
void read_mesh_stl(std::string_view input) { read_mesh(write("mesh.stl", input)); }

void read_mesh_pieces(std::string_view input) {
  constexpr int kMost = 8;  // few, so that an input takes little time
  const TriangleMesh mesh = load_mesh(write("mesh.obj", input));
  check_pieces(convex_pieces(mesh, {MeshKind::kPieces, 0.0, kMost}, "mesh.obj"), kMost);
}

void read_height_image(std::string_view input) {
  check_heights(load_height_image(write("heights.png", input)));
}
void read_height_table(std::string_view input) {
  check_heights(load_height_table(write("heights.csv", input)));
}

}  // namespace counterpoint::fuzz
