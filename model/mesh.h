// Meshes: files through assimp, convex hulls through qhull.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

struct TriangleMesh {
  std::vector<Vector3> vertices;               ///< [m]
  std::vector<std::array<int, 3>> triangles;   ///< counter-clockwise seen from outside
};

/// Reads STL (ascii, binary), OBJ or DAE (unit and up axis applied), all submeshes welded into one,
/// scaled per axis. @throws InputError naming the file when it is missing, unreadable, empty, or
/// holds coordinates that are not finite.
TriangleMesh load_mesh(const std::filesystem::path& file, const Vector3& scale = Vector3::Ones());

/// Convex hull, coplanar triangles merged into polygons. @throws InputError (with `source`) when the
/// points span no volume.
std::shared_ptr<const ConvexMesh> make_convex_hull(const std::vector<Vector3>& points,
                                                   const std::string& source = "");

/// Volume [m^3] enclosed by a closed mesh (divergence theorem); meaningless for an open one.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace counterpoint
