// Collision geometry: shapes, convex meshes, terrain and surface materials, and the functions that
// read meshes and height fields from files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "counterpoint/model/material.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

// ---- Shapes and materials.

/// Neighbours of every mesh vertex (vertices joined to it by an edge) with their positions, stored
/// one list after the other in one array: a search that climbs from vertex to vertex then has few
/// cache misses.
struct VertexNeighbors {
  struct Neighbor {
    Vector3 place = Vector3::Zero();  ///< position of `vertex` [m]
    int vertex = 0;
  };
  std::vector<int> begin = {0};  ///< start of each vertex's list in `all`, then the end
  std::vector<Neighbor> all;

  std::size_t size() const { return begin.size() - 1; }
  std::span<const Neighbor> operator[](std::size_t vertex) const {
    return {all.data() + begin[vertex], all.data() + begin[vertex + 1]};
  }
};

/// A closed convex polyhedron. Created by make_convex_hull; shared between instances.
struct ConvexMesh {
  std::vector<Vector3> vertices;  ///< [m], in the geometry frame
  /// Polygons (coplanar triangles merged), counter-clockwise seen from outside.
  std::vector<std::vector<int>> faces;
  std::vector<Vector3> face_normals;  ///< unit, outward
  std::vector<double> face_offsets;   ///< [m]: normal . x = offset on the face
  VertexNeighbors vertex_neighbors;
  std::vector<std::vector<int>> vertex_faces;  ///< faces around each vertex, ascending
  /// Rows x, y, z of the vertices relative to interior_point, and of the face normals, for
  /// evaluating all of them at once; the last entry is repeated up to a multiple of eight.
  std::array<std::vector<double>, 3> vertex_columns, normal_columns;
  Vector3 interior_point = Vector3::Zero();  ///< strictly inside (mean of the vertices)
  double radius = 0.0;         ///< largest distance of a vertex from interior_point [m]
  double volume = 0.0;         ///< volume of the hull [m^3]
  double source_volume = 0.0;  ///< volume of the source mesh [m^3]; 0 if it was not closed
  /// Largest distance of the full hull's surface from its source mesh [m] (hull_standoff.h).
  double standoff = 0.0;
  /// Largest distance [m] by which the full hull extends beyond this reduced one (reduce_hull); 0
  /// if this is the full hull.
  double deviation = 0.0;
  std::string source;  ///< source file; empty if built in memory
  /// Convex pieces that collide in place of the hull (convex_pieces); empty: the hull collides. A
  /// model has a geometry for each.
  std::vector<std::shared_ptr<const ConvexMesh>> pieces;
  /// Largest distance between the surfaces of mesh and union of the pieces [m], for a piece or a
  /// hull with pieces; else 0.
  double union_standoff = 0.0;
  std::string hull_reason;  ///< why a concave mesh has no pieces; "" if it needs none or has some
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
///   kPlane       unused: the half-space z <= 0 of G, outward normal +z
///   kSphere      (radius, -, -)
///   kBox         half lengths along x, y, z
///   kCapsule     (radius, half length of the segment along z, -)
///   kCylinder    (radius, half length along z, -)
///   kConvexMesh  unused: see `mesh`
///   kTerrain     unused: see `terrain`; must be fixed to the world
struct Shape {
  ShapeType type = ShapeType::kSphere;
  Vector3 size = Vector3::Zero();
  std::shared_ptr<const ConvexMesh> mesh;
  std::shared_ptr<const Terrain> terrain = nullptr;
};

/// A shape attached to a body.
struct Geometry {
  std::string name;  ///< "<link>/<collision name or index>", unique in a model
  int body = 0;      ///< index of its body; 0 is the world
  /// Index into Model::frames of its link; -1 for environment geometry such as the ground.
  int frame = -1;
  int instance = -1;  ///< model instance; -1 for environment geometry
  /// Index of the assembly of its link: all links that joints connect, except floating joints and
  /// connections through the world (the links of a robot, one free object). -1 for environment
  /// geometry and for the shapes of a link that represents the world.
  int assembly = -1;
  /// Index of the first piece, if it is one of the pieces of a mesh, which follow each other; else
  /// -1.
  int whole = -1;
  Pose X_BG;  ///< pose in the body frame
  Shape shape;
  Material material;
};

/// Returns the smallest world z [m] of a shape whose frame G has the pose X_WG; -infinity for a
/// plane.
double lowest_point(const Shape& shape, const Pose& X_WG);

/// Returns "plane", "sphere" ...; for a convex mesh the given name `convex_mesh`.
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

/// Triangulation of polygons with more than three corners, which matters where they are not flat.
enum class PolygonSplit {
  kInside,  ///< within the polygon, as assimp does
  kEars,    ///< ear cutting as in MuJoCo's OBJ reader (model/mesh/ear_cutting.h)
};

/// Reads an STL (ascii, binary), OBJ or DAE file (the unit of a DAE is applied and its up axis
/// becomes z). All submeshes are welded into one and scaled per axis (a mirroring scale keeps the
/// outside outside). Coordinates pass through single precision. No other file is opened, whatever
/// the mesh refers to.
/// @throws InputError naming the file when it is missing, unreadable, empty or beyond the limits of
/// model/limits.h, or has coordinates that are not finite.
TriangleMesh load_mesh(const std::filesystem::path& file, const Vector3& scale = Vector3::Ones(),
                       PolygonSplit split = PolygonSplit::kInside);

/// Returns the convex hull of points [m]; triangles that are coplanar to about one millionth of the
/// size are merged into polygons.
/// @throws InputError (with `source`) when the points span no volume.
std::shared_ptr<const ConvexMesh> make_convex_hull(const std::vector<Vector3>& points,
                                                   const std::string& source = "");

/// How the mesh of a body collides.
enum class MeshKind : unsigned char {
  kAuto,   ///< pieces if it is visibly concave, else the hull
  kHull,   ///< the convex hull
  kPieces  ///< convex pieces (model/pieces/pieces.h)
};
/// Returns the kind of the name "auto", "hull" or "pieces"; nothing for others.
std::optional<MeshKind> mesh_kind_from_name(const std::string& name);
struct MeshCollision {
  MeshKind kind = MeshKind::kAuto;
  double tolerance = 0.0;  ///< pieces stand off at most this [m]; 0: 2 % of the hull's diameter
  int most = 256;          ///< largest number of pieces
};

/// Returns the convex hull of a mesh with its standoff, with source_volume if the mesh is closed,
/// and with the pieces that `collision` asks for.
/// @throws InputError as make_convex_hull.
std::shared_ptr<const ConvexMesh> convex_mesh_of(const TriangleMesh& mesh,
                                                 const MeshCollision& collision,
                                                 const std::string& source = "");

/// Returns the same for a mesh file.
/// @throws InputError as load_mesh and make_convex_hull.
std::shared_ptr<const ConvexMesh> load_convex_mesh(const std::filesystem::path& file,
                                                   const Vector3& scale = Vector3::Ones(),
                                                   const MeshCollision& collision = {});

/// Returns a hull of at most `max_vertices` of the hull's vertices, each chosen as the one farthest
/// outside the hull of those before it. The result lies inside the full hull; `deviation` gives the
/// largest distance. Returns the hull itself if it has no more vertices than that.
/// @throws InputError for max_vertices < 4.
std::shared_ptr<const ConvexMesh> reduce_hull(const std::shared_ptr<const ConvexMesh>& hull,
                                              int max_vertices);

/// Returns true if the hull has 5 % more volume than its closed source mesh, or stands off any
/// source mesh by more than 5 % of its diameter (twice its radius).
bool is_visibly_concave(const ConvexMesh& hull);

/// Returns the note for the user about a visibly concave mesh, which says how it collides; "" for
/// others.
std::string hull_note(const ConvexMesh& hull);

/// How the meshes of a scene collide.
struct MeshCollisions {
  MeshCollision others;                        ///< for meshes that `named` does not name
  std::map<std::string, MeshCollision> named;  ///< key: the name of the file, without its folder

  const MeshCollision& of(const std::filesystem::path& file) const {
    const auto found = named.find(file.filename().string());
    return found == named.end() ? others : found->second;
  }
};

/// Loads each mesh file once per scale, so that all instances share one hull.
class HullCache {
 public:
  /// `max_vertices` limits every hull and piece (reduce_hull); 0: no limit.
  explicit HullCache(int max_vertices = 0, MeshCollisions collisions = {})
      : max_vertices_(max_vertices), collisions_(std::move(collisions)) {}
  const MeshCollisions& collisions() const { return collisions_; }
  /// Returns the cached hull, or loads it. own: how the mesh collides by the robot's file, unless
  /// the scene names the mesh; a tolerance of 0 is that of the scene. @throws InputError as
  /// load_convex_mesh.
  std::shared_ptr<const ConvexMesh> load(const std::filesystem::path& file,
                                         const Vector3& scale = Vector3::Ones(),
                                         const std::optional<MeshCollision>& own = {});
  struct MeshFile {
    std::filesystem::path file;
    Vector3 scale = Vector3::Ones();
    std::optional<MeshCollision> own;
  };
  /// Loads meshes on all processors. One that does not load is left to `load`, which says why.
  void load_ahead(const std::vector<MeshFile>& meshes);

 private:
  /// File, scale, and the collision's kind, tolerance and number.
  using Key = std::tuple<std::filesystem::path, double, double, double, MeshKind, double, int>;
  MeshCollision collision_of(const MeshFile& mesh) const;
  Key key_of(const MeshFile& mesh) const;
  std::shared_ptr<const ConvexMesh> loaded(const MeshFile& mesh) const;

  int max_vertices_;
  MeshCollisions collisions_;
  std::map<Key, std::shared_ptr<const ConvexMesh>> hulls_;
};

/// Returns true if every edge is shared by two triangles that run along it in opposite directions.
bool is_closed(const TriangleMesh& mesh);

/// Returns the volume [m^3] enclosed by a closed mesh (divergence theorem); meaningless for an open
/// one.
double enclosed_volume(const TriangleMesh& mesh);

// ---- Bounding volume hierarchy: a tree of axis-aligned boxes over triangles.

struct TriangleTree {
  /// A leaf holds the triangles order[first ... first + count); an inner node has two children, the
  /// left one next in the array, the right one at `right`.
  struct Node {
    Vector3 low, high;
    int first = 0, count = 0;  ///< count is 0 for an inner node
    int right = 0;
  };
  std::vector<Node> nodes;  ///< the first is the root; at most 32 levels for any size
  std::vector<int> order;

  TriangleTree() = default;
  /// Builds the tree over triangles (at least one), given as indices into `vertices` [m].
  TriangleTree(const std::vector<Vector3>& vertices,
               const std::vector<std::array<int, 3>>& triangles);
};

// ---- Static triangle meshes for non-convex ground, from mesh files and height fields.

/// Triangles that act on bodies on their outer side only, the side from which their corners run
/// counter-clockwise. Created by make_terrain; shared between instances. Everything is in the
/// geometry frame.
struct Terrain {
  /// Type of a triangle's edge. At flat and concave edges bodies touch the faces only; contact with
  /// the edge itself is possible at convex edges and at the rim.
  enum class Edge : unsigned char { kFlat, kConcave, kConvex, kRim };

  struct Triangle {
    std::array<int, 3> vertices;
    Vector3 normal;                ///< unit, outward
    std::array<int, 3> neighbors;  ///< triangle across the edge from vertex i to i + 1; -1 at a rim
    std::array<Edge, 3> edges;
  };

  std::vector<Vector3> vertices;  ///< [m]
  std::vector<Triangle> triangles;
  Vector3 low, high;  ///< axis-aligned bounding box [m]
  int dropped = 0;    ///< number of triangles left out: without area, or duplicates
  /// Number of edges where the orientation changes or more than two triangles meet.
  int misfits = 0;
  std::string source;  ///< source file

  /// Appends the indices of the triangles whose boxes overlap the box low ... high [m], ascending.
  void find(const Vector3& box_low, const Vector3& box_high, std::vector<int>& out) const;

  TriangleTree tree;
  /// For each vertex, the vertices joined to it by an edge.
  std::vector<std::vector<int>> vertex_neighbors;
};

/// Builds a terrain from all triangles except those without area and duplicates, and classifies
/// every shared edge by the angle between its two faces.
/// @throws InputError (with `source`) when a coordinate is not finite, an index is out of range, or
/// no triangle is left.
std::shared_ptr<const Terrain> make_terrain(const TriangleMesh& mesh,
                                            const std::string& source = "");

// ---- Height fields: a grid of heights from an image or a table, as triangles.

/// A grid of heights; row 0 has the largest y and columns run along +x, as in an image.
struct HeightGrid {
  int rows = 0, columns = 0;
  std::vector<double> heights;  ///< row by row; [m], or 0 ... 1 for an image
};

/// Reads a grayscale PNG of 1 to 16 bits per pixel: black is 0, white is 1, no gamma is applied.
/// @throws InputError naming the file when it is missing, not a PNG, in colour or with an alpha
/// channel, damaged, or larger than limits::kMaxHeights.
HeightGrid load_height_image(const std::filesystem::path& file);

/// Reads comma-separated heights [m], one row per line, no header; blank lines and lines that begin
/// with # are skipped.
/// @throws InputError naming file and line when a row differs in length from the first, a cell is
/// not a finite number, or there are more than limits::kMaxHeights cells.
HeightGrid load_height_table(const std::filesystem::path& file);

/// Returns two triangles per cell, over size_x by size_y [m] centred at the origin, with heights
/// times `scale`.
/// @throws InputError (with `where`) for fewer than two rows or columns.
TriangleMesh height_field_mesh(const HeightGrid& grid, double size_x, double size_y, double scale,
                               const std::string& where);

}  // namespace counterpoint
