// Meshes: files through assimp, convex hulls through qhull.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

struct TriangleMesh {
  std::vector<Vector3> vertices;              ///< [m]
  std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise seen from outside
};

/// How polygons of more than three corners become triangles, which matters where they are bent.
enum class PolygonSplit {
  kInside,  ///< within the polygon, as assimp does it
  kEars,    ///< as MuJoCo reads OBJ files (model/mesh/ear_cutting.h)
};

/// Reads STL (ascii, binary), OBJ or DAE (its unit is applied, and its up axis becomes z), all
/// submeshes welded into one, scaled per axis (a mirroring scale keeps the outside outside).
/// Coordinates pass through single precision. @throws InputError naming the file when it is
/// missing, unreadable, empty, beyond the limits of model/limits.h, or has coordinates that are not
/// finite. No other file is opened, whatever the mesh names.
TriangleMesh load_mesh(const std::filesystem::path& file, const Vector3& scale = Vector3::Ones(),
                       PolygonSplit split = PolygonSplit::kInside);

/// Convex hull, triangles that are coplanar to about one millionth of the size merged into
/// polygons.
/// @throws InputError (with `source`) when the points span no volume.
std::shared_ptr<const ConvexMesh> make_convex_hull(const std::vector<Vector3>& points,
                                                   const std::string& source = "");

/// The convex hull of a mesh file, with its standoff, and with source_volume set if the mesh is closed.
/// Errors as above.
std::shared_ptr<const ConvexMesh> load_convex_mesh(const std::filesystem::path& file,
                                                   const Vector3& scale = Vector3::Ones());

/// A hull of at most `max_vertices` of the hull's vertices, each chosen as the one farthest outside those
/// before; it lies within the hull, `deviation` says how deep. The hull itself if it has no more.
/// @throws InputError for fewer than 4 vertices.
std::shared_ptr<const ConvexMesh> reduce_hull(const std::shared_ptr<const ConvexMesh>& hull,
                                              int max_vertices);

/// True if the hull has 5 % more volume than a closed mesh, or stands off any mesh by more than 5 % of
/// its diameter (twice its radius).
bool is_visibly_concave(const ConvexMesh& hull);

/// What a reader must know about a visibly concave mesh that became its hull; "" for others.
std::string hull_note(const ConvexMesh& hull);

/// Loads each mesh file once a scale, so that all instances share one hull.
class HullCache {
 public:
  /// max_vertices: of every hull; 0: no limit.
  explicit HullCache(int max_vertices = 0) : max_vertices_(max_vertices) {}
  /// As load_convex_mesh.
  std::shared_ptr<const ConvexMesh> load(const std::filesystem::path& file,
                                         const Vector3& scale = Vector3::Ones());

 private:
  int max_vertices_;
  std::map<std::tuple<std::filesystem::path, double, double, double>,
           std::shared_ptr<const ConvexMesh>>
      hulls_;
};

/// True if every edge is shared by two triangles that run along it in opposite directions.
bool is_closed(const TriangleMesh& mesh);

/// Volume [m^3] enclosed by a closed mesh (divergence theorem); meaningless for an open one.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace counterpoint
