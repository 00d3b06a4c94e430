// Collision geometry: shapes, convex meshes, terrain, surface materials; meshes and height fields
// in files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

// ---- Shapes and materials.

/// Which vertices of a mesh an edge joins, and where they are: list after list, for searches that
/// climb from vertex to vertex and would wait for memory wherever the next list lies.
struct VertexNeighbors {
  struct Neighbor {
    Vector3 place = Vector3::Zero();  ///< [m], as of the vertex
    int vertex = 0;
  };
  std::vector<int> begin = {0};  ///< by vertex, where its list begins in `all`, and the end
  std::vector<Neighbor> all;

  std::size_t size() const { return begin.size() - 1; }
  std::span<const Neighbor> operator[](std::size_t vertex) const {
    return {all.data() + begin[vertex], all.data() + begin[vertex + 1]};
  }
};

/// A closed convex polyhedron. Made by make_convex_hull; shared between instances.
struct ConvexMesh {
  std::vector<Vector3> vertices;  ///< [m], in the geometry frame
  /// Polygons (coplanar triangles merged), counter-clockwise seen from outside.
  std::vector<std::vector<int>> faces;
  std::vector<Vector3> face_normals;  ///< unit, outward
  std::vector<double> face_offsets;   ///< [m]: normal . x = offset on the face
  VertexNeighbors vertex_neighbors;
  std::vector<std::vector<int>> vertex_faces;  ///< faces around each vertex, ascending
  /// x, y and z of the vertices, from interior_point, and of the face normals; the last one
  /// repeated up to a multiple of eight. For a look at all of them at once.
  std::array<std::vector<double>, 3> vertex_columns, normal_columns;
  Vector3 interior_point = Vector3::Zero();  ///< strictly inside (mean of the vertices)
  double radius = 0.0;         ///< largest distance of a vertex from interior_point [m]
  double volume = 0.0;         ///< of the hull [m^3]
  double source_volume = 0.0;  ///< of the mesh it was made from [m^3]; 0 if that was not closed
  /// Farthest that the surface of the full hull stands off its mesh [m] (hull_standoff.h).
  double standoff = 0.0;
  double deviation = 0.0;  ///< how far the full hull reaches out of this one [m]; 0: this is it
  std::string source;      ///< file it came from, empty if built in memory
};

struct Terrain;

enum class ShapeType : unsigned char {
  kPlane,
  kSphere,
  kBox,
  kCapsule,
  kCylinder,
  kConvexMesh,
  kTerrain
};

/// A shape in its geometry frame G. `size` [m] holds, by type:
///   kPlane       nothing: the half-space z <= 0 of G, outward normal +z
///   kSphere      (radius, -, -)
///   kBox         half lengths along x, y, z
///   kCapsule     (radius, half length of the segment along z, -)
///   kCylinder    (radius, half length along z, -)
///   kConvexMesh  nothing: see mesh
///   kTerrain     nothing: see Terrain; fixed to the world only
struct Shape {
  ShapeType type = ShapeType::kSphere;
  Vector3 size = Vector3::Zero();
  std::shared_ptr<const ConvexMesh> mesh;
  std::shared_ptr<const Terrain> terrain = nullptr;
};

/// Surface material. Two surfaces combine as in combine_materials.
struct Material {
  double friction = 0.8;            ///< Coulomb coefficient, sliding [-]
  double restitution = 0.0;         ///< Newton's, 0 ... 1 [-]
  double torsional_friction = 0.0;  ///< spin about the normal: torque / normal force [m]
  double rolling_friction = 0.0;    ///< rolling: torque / normal force [m]
};

/// A shape attached to a body.
struct Geometry {
  std::string name;   ///< "<link>/<collision name or index>", unique in a model
  int body = 0;       ///< index of the body it moves with; 0 is the world
  int frame = -1;     ///< of the link that it came from; -1 for environment geometry, as the ground
  int instance = -1;  ///< model instance it belongs to; -1 for environment geometry
  /// Number of the links that joints hold together, other than through the world and by floating
  /// joints: the links of a robot, one free object; -1 for environment geometry and shapes of a
  /// link that is the world.
  int assembly = -1;
  Pose X_BG;  ///< pose in the body frame
  Shape shape;
  Material material;
};

/// Material of a pair: geometric mean of the sliding frictions (MuJoCo takes the maximum, Bullet
/// the product, ODE one value a pair); the larger restitution, torsional and rolling friction (the
/// last two as MuJoCo). Torsional and rolling friction do nothing without sliding friction, and a
/// pair with a side without that has none.
Material combine_materials(const Material& a, const Material& b);

/// The smallest z [m] that a shape reaches when its frame G is at X_WG; -infinity for a plane.
double lowest_point(const Shape& shape, const Pose& X_WG);

/// "plane", "sphere" ...; `convex_mesh`: what a convex mesh is called where the name goes.
inline const char* shape_type_name(ShapeType type, const char* convex_mesh) {
  switch (type) {
    case ShapeType::kPlane:
      return "plane";
    case ShapeType::kSphere:
      return "sphere";
    case ShapeType::kBox:
      return "box";
    case ShapeType::kCapsule:
      return "capsule";
    case ShapeType::kCylinder:
      return "cylinder";
    case ShapeType::kConvexMesh:
      return convex_mesh;
    case ShapeType::kTerrain:
      return "terrain";
  }
  return "?";
}

// ---- Meshes: files through assimp, convex hulls through qhull.

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

/// The convex hull of a mesh file, with its standoff, and with source_volume set if the mesh is
/// closed. Errors as above.
std::shared_ptr<const ConvexMesh> load_convex_mesh(const std::filesystem::path& file,
                                                   const Vector3& scale = Vector3::Ones());

/// A hull of at most `max_vertices` of the hull's vertices, each chosen as the one farthest outside
/// those before; it lies within the hull, `deviation` says how deep. The hull itself if it has no
/// more.
/// @throws InputError for fewer than 4 vertices.
std::shared_ptr<const ConvexMesh> reduce_hull(const std::shared_ptr<const ConvexMesh>& hull,
                                              int max_vertices);

/// True if the hull has 5 % more volume than a closed mesh, or stands off any mesh by more than 5 %
/// of its diameter (twice its radius).
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

// ---- A tree of boxes over triangles (bounding volume hierarchy).

struct TriangleTree {
  /// Triangles order[first ... first + count), or two children, the left one next in the array.
  struct Node {
    Vector3 low, high;
    int first = 0, count = 0;  ///< count 0: an inner node
    int right = 0;
  };
  std::vector<Node> nodes;  ///< the first holds all; at most 32 levels for any number of triangles
  std::vector<int> order;

  TriangleTree() = default;
  /// Of triangles (at least one) by their vertices [m].
  TriangleTree(const std::vector<Vector3>& vertices,
               const std::vector<std::array<int, 3>>& triangles);
};

// ---- Static triangle meshes: ground that is not convex. From mesh files and height fields.

/// Triangles that push bodies off the side from which they run counter-clockwise. Made by
/// make_terrain; shared between instances. Everything in the geometry frame.
struct Terrain {
  /// How a triangle's edge is shared. At flat and concave edges bodies touch the faces only;
  /// contact with the edge itself is possible where the surface bends away from them, and at its
  /// rim.
  enum class Edge : unsigned char { kFlat, kConcave, kConvex, kRim };

  struct Triangle {
    std::array<int, 3> vertices;
    Vector3 normal;                ///< unit, outward
    std::array<int, 3> neighbors;  ///< across the edge from vertex i to i + 1; -1 at a rim
    std::array<Edge, 3> edges;
  };

  std::vector<Vector3> vertices;  ///< [m]
  std::vector<Triangle> triangles;
  Vector3 low, high;   ///< the box around all [m]
  int dropped = 0;     ///< triangles left out: without area, or given twice
  int misfits = 0;     ///< edges where orientation changes or more than two triangles meet
  std::string source;  ///< file it came from

  /// Appends the triangles whose boxes meet the box low ... high [m], in ascending order.
  void find(const Vector3& box_low, const Vector3& box_high, std::vector<int>& out) const;

  TriangleTree tree;
  std::vector<std::vector<int>> vertex_neighbors;  ///< vertices joined by an edge
};

/// Takes the triangles as they are but for those without area and duplicates; every other edge is
/// classified by the angle between its two faces. @throws InputError (with `source`) when a
/// coordinate is not finite, an index is out of range, or no triangle is left.
std::shared_ptr<const Terrain> make_terrain(const TriangleMesh& mesh,
                                            const std::string& source = "");

// ---- Height fields: a grid of heights from an image or a table, as triangles.

/// A grid of heights; row 0 lies at the largest y, columns run along +x, as an image is looked at.
struct HeightGrid {
  int rows = 0, columns = 0;
  std::vector<double> heights;  ///< row by row [m, or 0 ... 1 for an image]
};

/// A grayscale PNG of 1 to 16 bits a pixel, black 0, white 1, no gamma applied. @throws InputError
/// naming the file when it is missing, no PNG, in colour or with an alpha channel, damaged, or
/// larger than limits::kMaxHeights.
HeightGrid load_height_image(const std::filesystem::path& file);

/// Comma-separated heights [m], one row a line, no header; blank lines and lines that begin with #
/// are skipped. @throws InputError naming file and line when a row has another length than the
/// first, a cell is no finite number, or there are more than limits::kMaxHeights.
HeightGrid load_height_table(const std::filesystem::path& file);

/// Two triangles a cell, over size_x by size_y [m] around the origin, heights times `scale`.
/// @throws InputError (with `where`) for fewer than two rows or columns.
TriangleMesh height_field_mesh(const HeightGrid& grid, double size_x, double size_y, double scale,
                               const std::string& where);

}  // namespace counterpoint
