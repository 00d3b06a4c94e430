// Meshes: files through assimp, convex hulls through qhull.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

struct TriangleMesh {
  std::vector<Vector3> vertices;              ///< [m]
  std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise seen from outside
};

/// Reads STL (ascii, binary), OBJ or DAE (its unit is applied, and its up axis becomes z), all
/// submeshes welded into one, scaled per axis (a mirroring scale keeps the outside outside).
/// Coordinates pass through single precision. @throws InputError naming the file when it is
/// missing, unreadable, empty, has more than 5 million vertices, or coordinates that are not
/// finite.
TriangleMesh load_mesh(const std::filesystem::path& file, const Vector3& scale = Vector3::Ones());

/// Convex hull, triangles that are coplanar to about one millionth of the size merged into
/// polygons.
/// @throws InputError (with `source`) when the points span no volume.
std::shared_ptr<const ConvexMesh> make_convex_hull(const std::vector<Vector3>& points,
                                                   const std::string& source = "");

/// The convex hull of a mesh file, with source_volume set if the mesh is closed. Errors as above.
std::shared_ptr<const ConvexMesh> load_convex_mesh(const std::filesystem::path& file,
                                                   const Vector3& scale = Vector3::Ones());

/// True if every edge is shared by two triangles that run along it in opposite directions.
bool is_closed(const TriangleMesh& mesh);

/// Volume [m^3] enclosed by a closed mesh (divergence theorem); meaningless for an open one.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace counterpoint
